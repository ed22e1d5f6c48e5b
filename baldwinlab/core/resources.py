"""Free memory and disk of this machine, and a check that a command needs no more."""

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
CONTROL_GROUPS: Final = Path("/sys/fs/cgroup")


class Need(NamedTuple):
    """Memory and disk that some work needs, in bytes."""

    memory: int = 0
    disk: int = 0

    def add_later(self, later: Need) -> Need:
        """Return the need of this work followed by `later`: memory is reused, and disk is not."""
        return Need(max(self.memory, later.memory), self.disk + later.disk)


NO_NEED: Final = Need()


def require_resources(
    request: str, need: Need, folder: Path | None = None, *, force: bool = False
) -> None:
    """Raise RefusedError if a request needs more memory or disk than is free.

    Parameters
    ----------
    request
        The requested work, such as "3 runs", for the message.
    need
        Memory and disk that the work needs.
    folder
        Folder of the written files. It may not exist yet. Remote storage is not checked.
    force
        Check nothing.
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
    """Return a number of bytes as text with a unit: 44.7 GiB."""
    largest_power = len(BYTE_UNITS) - 1
    power = min((max(count, 1).bit_length() - 1) // 10, largest_power)
    number_format = ".1f" if power < largest_power else ".3g"
    return f"{count / 1024**power:{number_format}} {BYTE_UNITS[power]}"


def free_disk(folder: Path) -> int:
    """Return the bytes that are free on the disk of a folder, which may not exist yet."""
    parents = (folder, *folder.absolute().parents)
    existing = next(parent for parent in parents if parent.exists())
    return shutil.disk_usage(existing).free


def peak_memory() -> int | None:
    """Return the largest memory that this process has used, in bytes; None on Windows.

    On Linux `ru_maxrss` includes the memory of the parent process at the start, so /proc is read.
    """
    if (peak := _read_proc("self/status", "VmHWM")) is not None:
        return peak
    try:
        import resource
    except ImportError:
        return None
    # The unit of `ru_maxrss` is a byte on macOS, and a KiB on other systems.
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit


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
        # The file holds the name of the process, which may have any characters.
        lines = Path("/proc", file).read_text("ascii", "replace").splitlines()
        return next(int(line.split()[1]) * 1024 for line in lines if line.startswith(f"{name}:"))
    except (OSError, StopIteration):
        return None


def free_memory_of_groups(
    groups: Path = CONTROL_GROUPS, membership: Path = Path("/proc/self/cgroup")
) -> Iterator[int]:
    """Yield the free memory, in bytes, of each control group of this process that has a limit.

    The parents of a group are included. In a container the root can be the group of the process.

    References
    ----------
    Linux, Documentation/admin-guide/cgroup-v2.rst and cgroup-v1/memory.rst.
    """
    try:
        lines = membership.read_text("utf-8").splitlines()
    except OSError:
        return
    for line in lines:
        number, controllers, path = line.split(":", 2)
        if number == "0":
            root = groups
            names = ("memory.max", "memory.current", "inactive_file")
        elif "memory" in controllers.split(","):
            root = groups / "memory"
            names = ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file")
        else:
            continue
        process_group = root / path.lstrip("/")
        for group in (process_group, *process_group.parents):
            if group.is_relative_to(root) and (free := _free_in_group(group, *names)) is not None:
                yield free


def _free_in_group(group: Path, limit: str, used: str, reclaimable: str) -> int | None:
    """Return the limit of a group minus its use without reclaimable files; None without a limit."""
    try:
        counts = dict(
            line.split() for line in (group / "memory.stat").read_text("ascii").splitlines()
        )
        in_use = int((group / used).read_text("ascii")) - int(counts.get(reclaimable, 0))
        return max(0, int((group / limit).read_text("ascii")) - in_use)
    except (OSError, ValueError):
        # The group does not exist, or its limit is "max".
        return None
