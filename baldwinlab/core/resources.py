"""Memory, disk and cores that this process may use, and a check that they suffice for a command."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Final, NamedTuple

from baldwinlab.core.errors import RefusedError
from baldwinlab.core.files import is_local

BYTE_UNITS: Final = ("bytes", "KiB", "MiB", "GiB", "TiB", "PiB")
BYTES_PER_KIB: Final = 1024
# Folder of the control groups, in which Linux limits memory and CPU of several processes together.
CONTROL_GROUPS: Final = Path("/sys/fs/cgroup")
# File with the control groups of this process.
GROUP_MEMBERSHIP: Final = Path("/proc/self/cgroup")


class Need(NamedTuple):
    """Memory and disk that some work needs, in bytes."""

    memory: int = 0
    disk: int = 0

    def add_later(self, later: Need) -> Need:
        """Return the need of this work followed by `later` work, which reuses only the memory."""
        return Need(max(self.memory, later.memory), self.disk + later.disk)


NO_NEED: Final = Need()


class _GroupNames(NamedTuple):
    """Names of two files of a control group, and of a count in the file memory.stat."""

    limit_file: str
    usage_file: str
    reclaimable_count: str


# Names in version 1 and in version 2 of control groups.
GROUP_NAMES_1: Final = _GroupNames(
    limit_file="memory.limit_in_bytes",
    usage_file="memory.usage_in_bytes",
    reclaimable_count="total_inactive_file",
)
GROUP_NAMES_2: Final = _GroupNames(
    limit_file="memory.max", usage_file="memory.current", reclaimable_count="inactive_file"
)


def require_resources(
    request: str, need: Need, folder: Path | None = None, *, force: bool = False
) -> None:
    """Raise RefusedError if a request needs more memory or disk than is free.

    `request`: the requested work in the message, such as "3 runs". `folder`: folder of the written
    files, which may not exist yet. The disk of remote storage is not checked.
    """
    if force:
        return
    _require_free(request, "memory", need.memory, available_memory(), "on this machine")
    if folder is not None and is_local(folder):
        _require_free(request, "disk", need.disk, free_disk(folder), f"for {folder}")


def _require_free(
    request: str, resource: str, needed: int, free: int | None, location: str
) -> None:
    """Raise RefusedError if fewer bytes are free than are needed. Unknown amounts pass."""
    if free is not None and needed > free:
        raise RefusedError(
            f"{request}: needs about {format_bytes(needed)} of {resource}, but only "
            f"{format_bytes(free)} are free {location}. Reduce the request or add --force."
        )


def format_bytes(count: int) -> str:
    """Return a number of bytes as text with a unit: 44.7 GiB.

    >>> format_bytes(1_500_000)
    '1.4 MiB'
    """
    largest_power = len(BYTE_UNITS) - 1
    # Each unit is 2**10 times the previous unit.
    exponent_of_2 = max(count, 1).bit_length() - 1
    power = min(exponent_of_2 // 10, largest_power)
    number_format = ".1f" if power < largest_power else ".3g"
    return f"{count / BYTES_PER_KIB**power:{number_format}} {BYTE_UNITS[power]}"


def free_disk(folder: Path) -> int:
    """Return the free bytes on the disk of a folder. The folder may not exist yet."""
    parents = (folder, *folder.absolute().parents)
    existing_folder = next(parent for parent in parents if parent.exists())
    return shutil.disk_usage(existing_folder).free


def peak_memory() -> int | None:
    """Return the largest memory that this process has used, in bytes; None on Windows.

    On Linux, /proc is read, because `ru_maxrss` includes memory of the parent process.
    """
    if (peak := _read_proc("self/status", "VmHWM")) is not None:
        return peak
    try:
        import resource
    except ImportError:
        return None
    # The unit of `ru_maxrss` is a byte on macOS, and a KiB on other systems.
    unit_bytes = 1 if sys.platform == "darwin" else BYTES_PER_KIB
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit_bytes


def available_memory() -> int | None:
    """Return the bytes that this process can still allocate; None if the system does not report it.

    The result is the smallest of the free memory of the machine and of each control group.
    """
    free_amounts = [_free_machine_memory(), *free_memory_of_groups()]
    return min((amount for amount in free_amounts if amount is not None), default=None)


def _free_machine_memory() -> int | None:
    """Return the available memory on Linux; on other systems the total memory, or None."""
    if (free := _read_proc("meminfo", "MemAvailable")) is not None:
        return free
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return None


def _read_proc(file: str, name: str) -> int | None:
    """Return a number of bytes from a file of /proc; None on systems without this file."""
    try:
        # The name of the process in the file may have characters that are not ASCII.
        lines = Path("/proc", file).read_text("ascii", "replace").splitlines()
        line = next(line for line in lines if line.startswith(f"{name}:"))
        # A line is "NAME: NUMBER kB".
        kib = int(line.split()[1])
        return kib * BYTES_PER_KIB
    except (OSError, StopIteration):
        return None


def free_memory_of_groups(
    groups: Path = CONTROL_GROUPS, membership: Path = GROUP_MEMBERSHIP
) -> Iterator[int]:
    """Yield the free memory, in bytes, of each control group of this process that has a limit."""
    for group, version in _list_groups("memory", groups, membership):
        free = _free_in_group(group, GROUP_NAMES_2 if version == 2 else GROUP_NAMES_1)
        if free is not None:
            yield free


def cores_of_groups(
    groups: Path = CONTROL_GROUPS, membership: Path = GROUP_MEMBERSHIP
) -> Iterator[float]:
    """Yield the cores that each control group of this process with a limit may use, such as 1.5.

    The limit is a quota of CPU time in each period.
    """
    for group, version in _list_groups("cpu", groups, membership):
        files = ["cpu.max"] if version == 2 else ["cpu.cfs_quota_us", "cpu.cfs_period_us"]
        try:
            texts = " ".join((group / file).read_text("ascii") for file in files)
            quota, period = map(int, texts.split())
        except (OSError, ValueError):
            # The group does not exist, or its quota is "max".
            continue
        # In version 1, the quota of a group without a limit is -1.
        if quota > 0:
            yield quota / period


def _list_groups(controller: str, groups: Path, membership: Path) -> Iterator[tuple[Path, int]]:
    """Yield the folder and the version of each control group of this process with a controller.

    The parents of a group are included. In a container the root can be the group of the process.

    References
    ----------
    Linux, Documentation/admin-guide/cgroup-v2.rst, cgroup-v1/memory.rst and
    scheduler/sched-bwc.rst.
    """
    try:
        lines = membership.read_text("utf-8").splitlines()
    except OSError:
        return
    for line in lines:
        # Hierarchy 0 belongs to version 2 of control groups.
        hierarchy, controllers, path = line.split(":", 2)
        if hierarchy == "0":
            root, version = groups, 2
        elif controller in controllers.split(","):
            root, version = groups / controller, 1
        else:
            continue
        process_group = root / path.lstrip("/")
        for group in (process_group, *process_group.parents):
            if group.is_relative_to(root):
                yield group, version


def _free_in_group(group: Path, names: _GroupNames) -> int | None:
    """Return the limit of a group minus its used, not reclaimable memory; None without a limit."""
    try:
        limit = int((group / names.limit_file).read_text("ascii"))
        used = int((group / names.usage_file).read_text("ascii"))
        counts = dict(
            line.split() for line in (group / "memory.stat").read_text("ascii").splitlines()
        )
        reclaimable = int(counts.get(names.reclaimable_count, 0))
        return max(0, limit - (used - reclaimable))
    except (OSError, ValueError):
        # The group does not exist, or its limit is "max".
        return None
