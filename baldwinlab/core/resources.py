"""Memory and disk: how much is free on this machine, and a check that a command needs no more."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Final, NamedTuple

from baldwinlab.core.errors import RefusedError
from baldwinlab.core.files import is_local

UNITS: Final = ("bytes", "KiB", "MiB", "GiB", "TiB", "PiB")
GROUPS: Final = Path("/sys/fs/cgroup")


class Need(NamedTuple):
    """Memory and disk that some work needs, in bytes."""

    memory: int = 0
    disk: int = 0

    def add_later(self, later: Need) -> Need:
        """Return the need of both, one after the other: memory is reused, and disk is not."""
        return Need(max(self.memory, later.memory), self.disk + later.disk)


NOTHING: Final = Need()


def require(what: str, need: Need, folder: Path | None = None, *, force: bool = False) -> None:
    """Raise RefusedError if `what` needs more memory or disk than is free.

    Parameters
    ----------
    what
        The work, such as "3 runs", for the message.
    need
        Memory and disk that it needs.
    folder
        Where it writes. It may not exist yet. A folder in remote storage is not checked.
    force
        Check nothing.
    """
    if force:
        return
    _require_free(what, "memory", need.memory, available_memory(), "on this machine")
    if folder is not None and is_local(folder):
        _require_free(what, "disk", need.disk, free_disk(folder), f"for {folder}")


def _require_free(what: str, resource: str, needed: int, free: int | None, where: str) -> None:
    """Raise RefusedError if fewer bytes are free than are needed. Unknown amounts pass."""
    if free is not None and needed > free:
        raise RefusedError(
            f"{what}: needs about {amount(needed)} of {resource}, but only {amount(free)} are free "
            f"{where}. Reduce the request or add --force."
        )


def amount(count: int) -> str:
    """Return a number of bytes with a unit: 44.7 GiB."""
    power = min((max(count, 1).bit_length() - 1) // 10, len(UNITS) - 1)
    return f"{count / 1024**power:{'.1f' if power < len(UNITS) - 1 else '.3g'}} {UNITS[power]}"


def free_disk(folder: Path) -> int:
    """Return the bytes that are free on the disk of a folder, which may not exist yet."""
    parents = (folder, *folder.absolute().parents)
    existing = next(parent for parent in parents if parent.exists())
    return shutil.disk_usage(existing).free


def peak_memory() -> int | None:
    """Return the largest memory of this process so far, in bytes; None on Windows.

    On Linux `ru_maxrss` includes the memory of the parent process at the start, so /proc is read.
    """
    if (peak := _read_proc("self/status", "VmHWM")) is not None:
        return peak
    try:
        import resource
    except ImportError:
        return None
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (
        1 if sys.platform == "darwin" else 1024
    )


def available_memory() -> int | None:
    """Return the bytes that this process can still allocate; None if the system does not report it.

    It is the least of the free memory of the machine and of its control groups.
    """
    free = [_free_machine_memory(), *memory_of_groups()]
    return min((count for count in free if count is not None), default=None)


def _free_machine_memory() -> int | None:
    """Return the available memory on Linux; on other systems the total memory, or None."""
    if (free := _read_proc("meminfo", "MemAvailable")) is not None:
        return free
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return None


def _read_proc(file: str, name: str) -> int | None:
    """Return a number of bytes from a file of /proc; None on systems without it."""
    try:
        # The file holds the name of the process, which may have any characters.
        lines = Path("/proc", file).read_text("ascii", "replace").splitlines()
        return next(int(line.split()[1]) * 1024 for line in lines if line.startswith(f"{name}:"))
    except (OSError, StopIteration):
        return None


def memory_of_groups(
    groups: Path = GROUPS, membership: Path = Path("/proc/self/cgroup")
) -> Iterator[int]:
    """Yield the free memory, in bytes, of each control group of this process that has a limit.

    The parents of its groups are included. A container may see its own group as the root.

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
