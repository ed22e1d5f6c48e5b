"""Memory and disk: how much this machine has left, and that nothing is begun that needs more."""

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
    """What some work takes, bytes."""

    memory: int = 0
    disk: int = 0

    def then(self, other: Need) -> Need:
        """Both, one after the other: memory is used again, and disk is not."""
        return Need(max(self.memory, other.memory), self.disk + other.disk)


NOTHING: Final = Need()


def require(what: str, need: Need, folder: Path | None = None, *, force: bool = False) -> None:
    """Raises RefusedError, with both amounts, where `what` needs more memory than is left here, or more disk than `folder` has.

    The folder need not be there yet. Nothing is known of one in a store elsewhere, nor of memory where no system tells.
    """
    if force:
        return
    offers: list[tuple[str, int, int | None, str]] = [
        ("memory", need.memory, available_memory(), "on this machine")
    ]
    if folder is not None and is_local(folder):
        offers.append(("disk", need.disk, free_disk(folder), f"for {folder}"))
    for name, wanted, there, where in offers:
        if there is not None and wanted > there:
            raise RefusedError(
                f"{what}: about {amount(wanted)} of {name} would be needed, and {amount(there)} are free {where}; "
                "ask for less, or add --force to begin all the same"
            )


def amount(count: int) -> str:
    """So many bytes in words: 44.7 GiB."""
    power = min((max(count, 1).bit_length() - 1) // 10, len(UNITS) - 1)
    return f"{count / 1024**power:{'.1f' if power < len(UNITS) - 1 else '.3g'}} {UNITS[power]}"


def free_disk(folder: Path) -> int:
    """Bytes that may be written where a folder is, or will be."""
    there = next(parent for parent in (folder, *folder.absolute().parents) if parent.exists())
    return shutil.disk_usage(there).free


def peak_memory() -> int | None:
    """The most memory that this process has held, bytes; None on Windows, where Python does not tell.

    On Linux `ru_maxrss` would begin with what the parent held when it started this process, so it is read elsewhere.
    """
    if (held := _told_by_linux("self/status", "VmHWM")) is not None:
        return held
    try:
        import resource
    except ImportError:
        return None
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (
        1 if sys.platform == "darwin" else 1024
    )


def available_memory() -> int | None:
    """Bytes that this process may still take: of the machine's, and of what each of its control groups is allowed."""
    left = [_of_machine(), *memory_of_groups()]
    return min((bytes_left for bytes_left in left if bytes_left is not None), default=None)


def _of_machine() -> int | None:
    """What Linux says is available; elsewhere all there is, which is more; None where Python does not tell."""
    if (left := _told_by_linux("meminfo", "MemAvailable")) is not None:
        return left
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return None


def _told_by_linux(file: str, name: str) -> int | None:
    """Bytes that a file of /proc tells under a name; None elsewhere."""
    try:
        lines = (
            Path("/proc", file).read_text("ascii", "replace").splitlines()
        )  # a process may have any name
        return next(int(line.split()[1]) * 1024 for line in lines if line.startswith(f"{name}:"))
    except (OSError, StopIteration):
        return None


def memory_of_groups(
    groups: Path = GROUPS, membership: Path = Path("/proc/self/cgroup")
) -> Iterator[int]:
    """What is left in this process's control groups and in those that they lie in, as far as they have a limit.

    A container may see its own group alone, as if it were the uppermost. Source: Linux, Documentation/admin-guide/cgroup-v2.rst
    and cgroup-v1/memory.rst.
    """
    try:
        lines = membership.read_text("utf-8").splitlines()
    except OSError:
        return
    for line in lines:
        number, controllers, path = line.split(":", 2)
        if number == "0":
            top, names = groups, ("memory.max", "memory.current", "inactive_file")
        elif "memory" in controllers.split(","):
            top, names = (
                groups / "memory",
                ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"),
            )
        else:
            continue
        own = top / path.lstrip("/")
        for group in (own, *own.parents):
            if group.is_relative_to(top) and (left := _left_in(group, *names)) is not None:
                yield left


def _left_in(group: Path, limit: str, used: str, reclaimable: str) -> int | None:
    """A group's limit less what it holds, but for files of which the system would let go; None where it has no limit."""
    try:
        counts = dict(
            line.split() for line in (group / "memory.stat").read_text("ascii").splitlines()
        )
        held = int((group / used).read_text("ascii")) - int(counts.get(reclaimable, 0))
        return max(0, int((group / limit).read_text("ascii")) - held)
    except (OSError, ValueError):  # there is no such group, or its limit is "max"
        return None
