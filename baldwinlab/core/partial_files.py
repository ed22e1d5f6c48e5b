"""Temporary files of writers, which are renamed when they are complete.

    .NAME.MACHINE-RANDOM.partial

A writer holds a lock on its temporary file. The operating system releases the lock when the process
ends, also if it is killed. A file without a lock has no living writer, so it can be removed. Some
network file systems do not share locks between machines. A file of another machine is therefore
removed only after a day. Without locks, no file is removed.
"""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Final
from uuid import getnode, uuid4

from baldwinlab.core.files import PARTIAL_SUFFIX

try:
    import fcntl
except ImportError:
    # Windows has no such locks.
    fcntl = None  # type: ignore[assignment]

# Age in seconds at which a file of another machine is removed, if it has no lock.
MAX_AGE_OF_OTHER_MACHINES: Final = 24 * 3600
# The user of a study must not be led to another file. Windows does not have these flags.
OPEN_FLAGS: Final = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)


@cache
def identify_machine() -> str:
    """Return a short text that differs between machines, also if they have the same name."""
    address = getnode()
    # Without a network, Python draws a random address in each process, and marks it by this bit.
    is_random = bool(address >> 40 & 1)
    name = f"{socket.gethostname()} {0 if is_random else address}"
    return sha256(name.encode()).hexdigest()[:8]


@contextmanager
def hold_partial(path: Path, *, is_folder: bool) -> Iterator[Path]:
    """Create and lock an empty temporary file or folder next to `path`, and remove it at the end.

    Raises OSError if it cannot be created.
    """
    partial_path, handle = _create_locked(path, is_folder)
    try:
        yield partial_path
    finally:
        remove_tree(partial_path)
        if handle is not None:
            os.close(handle)


def _create_locked(path: Path, is_folder: bool) -> tuple[Path, int | None]:
    """Return the path of a new temporary file or folder, and the handle that holds its lock."""
    while True:
        name = f".{path.name}.{identify_machine()}-{uuid4().hex[:16]}{PARTIAL_SUFFIX}"
        partial_path = path.with_name(name)
        if is_folder:
            partial_path.mkdir()
        else:
            partial_path.touch(exist_ok=False)
        if fcntl is None:
            return partial_path, None
        # Another process can remove the file before it is locked. Then it is created again.
        with suppress(FileNotFoundError):
            handle = os.open(partial_path, os.O_RDONLY if is_folder else os.O_RDWR)
            if _can_lock(handle) and _is_at(partial_path, handle):
                return partial_path, handle
            os.close(handle)


def _can_lock(handle: int) -> bool:
    """Lock an open file. Return False if another process has locked it."""
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        # The file system has no locks, so no process removes the file.
        return True
    return True


def _is_at(path: Path, handle: int) -> bool:
    """Return whether an open file still has the path."""
    try:
        return os.path.samestat(path.lstat(), os.fstat(handle))
    except FileNotFoundError:
        return False


def remove_tree(path: Path) -> None:
    """Remove a file or a folder, if it exists."""
    if path.is_dir():
        # Imported late: it takes a while to load.
        import shutil

        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)


def remove_abandoned(directory: Path) -> None:
    """Remove the temporary files and folders below a folder that have no living writer.

    A file that cannot be opened, locked or removed stays.
    """
    if fcntl is None:
        return
    for folder, folder_names, file_names in os.walk(directory):
        partial_names = [
            name
            for name in (*folder_names, *file_names)
            if name.startswith(".") and name.endswith(PARTIAL_SUFFIX)
        ]
        folder_names[:] = [name for name in folder_names if name not in partial_names]
        for name in partial_names:
            with suppress(OSError):
                _remove_if_abandoned(Path(folder, name))


def _remove_if_abandoned(path: Path) -> None:
    """Remove a temporary file if it has no living writer. Raise OSError if that is unknown."""
    handle = os.open(path, (os.O_RDONLY if path.is_dir() else os.O_RDWR) | OPEN_FLAGS)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        is_of_this_machine = f".{identify_machine()}-" in path.name
        age = time.time() - os.fstat(handle).st_mtime
        if is_of_this_machine or age > MAX_AGE_OF_OTHER_MACHINES:
            remove_tree(path)
    finally:
        os.close(handle)
