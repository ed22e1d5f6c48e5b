"""Functions that write a file completely or not at all, locally and in remote storage.

The package writes every file with `atomic_path`, `write_atomically`, `write_json`,
`write_exclusively` or `append_line`. These functions do not follow a link that leads out of a
study.

A local file is written under a temporary name, and renamed when it is complete:

    .NAME.MACHINE-RANDOM.partial

A process holds a lock on its temporary file. The operating system releases the lock when the
process ends or is killed, so a temporary file without a lock can be removed. Some network file
systems do not share locks between machines. A temporary file of another machine is therefore
removed only after a day. On a system without locks, no temporary file is removed.
"""

from __future__ import annotations

import errno
import json
import os
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Final, NamedTuple
from uuid import getnode, uuid4

from baldwinlab.core.errors import RefusedError
from baldwinlab.core.files import (
    PARTIAL_SUFFIX,
    FileKind,
    is_local,
    make_remote_folder,
    name_file_in_errors,
    read_bytes,
    require_inside_study,
    require_no_device,
)

try:
    import fcntl
except ImportError:
    # Windows has no such locks.
    fcntl = None  # type: ignore[assignment]

# Age in seconds after which a temporary file of another machine is removed, if it has no lock.
MAX_AGE_OF_OTHER_MACHINES: Final = 24 * 3600
# `open` must not follow a link or wait for a pipe. Windows does not have these flags.
OPEN_FLAGS: Final = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)


class UnwrittenFile(NamedTuple):
    """A file that could not be written."""

    content: bytes
    error: Exception


class OptionalFiles(NamedTuple):
    """The files that `write_atomically` skips if they cannot be written."""

    folder: Path
    page: Path  # File that is never skipped, also if it is in the folder.
    unwritten: dict[Path, UnwrittenFile]


_optional_files: Final = ContextVar[OptionalFiles | None]("optional_files", default=None)


@contextmanager
def skip_unwritable(folder: Path, page: Path) -> Iterator[dict[Path, UnwrittenFile]]:
    """Skip the files in a folder, except for `page`, that cannot be written in this context.

    Yields the skipped files by path.
    """
    optional_files = OptionalFiles(folder, page, {})
    token = _optional_files.set(optional_files)
    try:
        yield optional_files.unwritten
    finally:
        _optional_files.reset(token)


def require_writable_path(path: Path, alternative: str = "") -> None:
    """Raise RefusedError if a file cannot be written, before its content is computed.

    `alternative`: end of the last sentence of the message, such as ", or ...".
    """
    if not is_local(path):
        return
    require_inside_study(path)
    parents = (path, *path.absolute().parents)
    existing_path = next(parent for parent in parents if parent.exists())
    folder = existing_path if existing_path.is_dir() else existing_path.parent
    if not (os.access(folder, os.W_OK) and os.access(existing_path, os.W_OK)):
        raise RefusedError(
            f"{path} cannot be written: {existing_path} is read-only. Copy the study to a folder "
            f"that can be written, and use the copy{alternative}."
        )


@contextmanager
def atomic_path(path: Path, *, exclusive: bool = False, is_folder: bool = False) -> Iterator[Path]:
    """Yield the path of an empty temporary file, and rename this file to `path` at the end.

    - `path`: the final path. Missing folders are created.
    - `exclusive`: raise FileExistsError if `path` exists at the end.
    - `is_folder`: create a folder instead of a file.
    """
    require_inside_study(path)
    require_no_device(path)
    with name_file_in_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        with hold_partial(path, is_folder=is_folder) as partial_path:
            yield partial_path
            if not is_folder:
                with partial_path.open("rb+") as file:
                    os.fsync(file.fileno())
            if exclusive:
                _name_exclusively(partial_path, path)
            else:
                partial_path.replace(path)


def _name_exclusively(partial_path: Path, path: Path) -> None:
    """Give a temporary file the name `path`. Raise FileExistsError if `path` exists."""
    try:
        os.link(partial_path, path)
    except FileExistsError:
        raise
    except OSError:
        # The file system has no hard links.
        with path.open("xb") as file:
            file.write(partial_path.read_bytes())


def write_atomically(path: Path, content: bytes | bytearray) -> Path:
    """Write a file completely or not at all.

    Raise as `atomic_path` does, except for a file that `skip_unwritable` skips.
    """
    try:
        _write_atomically(path, content)
    except (OSError, RefusedError) as error:
        optional_files = _optional_files.get()
        if (
            optional_files is None
            or path == optional_files.page
            or not path.is_relative_to(optional_files.folder)
        ):
            raise
        optional_files.unwritten[path] = UnwrittenFile(bytes(content), error)
    return path


def _write_atomically(path: Path, content: bytes | bytearray) -> None:
    if is_local(path):
        with atomic_path(path) as partial_path, partial_path.open("wb") as file:
            file.write(content)
    else:
        with name_file_in_errors(path):
            make_remote_folder(path.parent)
            # In remote storage a write is atomic, and a rename is not.
            path.write_bytes(content)


def write_json(path: Path, content: object) -> Path:
    """Write JSON completely or not at all.

    Raise ValueError for NaN, and as `write_atomically` does.
    """
    text = json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False)
    return write_atomically(path, f"{text}\n".encode())


def write_exclusively(path: Path, content: bytes) -> None:
    """Write a file, or raise FileExistsError if it exists with other content.

    Of several processes that write different contents, one succeeds. Other errors are those of
    `atomic_path`. If remote storage has no exclusive creation, the function reads the file after
    the write, so that it detects another process that has overwritten the file.
    """
    if is_local(path):
        with (
            suppress(FileExistsError),
            atomic_path(path, exclusive=True) as partial_path,
            partial_path.open("wb") as file,
        ):
            file.write(content)
    else:
        make_remote_folder(path.parent)
        try:
            with suppress(FileExistsError), path.open("xb") as file:
                file.write(content)
        except (ValueError, NotImplementedError):
            # The storage has no exclusive creation.
            if not path.exists():
                write_atomically(path, content)
    is_same_size = path.is_file() and path.stat().st_size == len(content)
    if not (is_same_size and path.read_bytes() == content):
        raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(path))


def require_appendable(path: Path) -> None:
    """Raise RefusedError if a local file is a link or no regular file."""
    if not is_local(path):
        return
    if path.is_symlink():
        raise RefusedError(f"{path} cannot be written: it is a link; remove it")
    # Opening a pipe without a reader would wait without end.
    if path.exists() and not path.is_file():
        raise RefusedError(f"{path} cannot be written: it is no regular file; remove it")


def append_line(path: Path, line: str, kind: FileKind) -> None:
    """Append a line to a file. Raise as `atomic_path`, and RefusedError for a link or a pipe.

    A file in remote storage cannot grow, so the function writes the complete file again. It also
    writes a file with a second hard link again, because the content of that link must not change.
    """
    require_inside_study(path)
    require_appendable(path)
    has_second_link = is_local(path) and path.exists() and path.stat().st_nlink > 1
    if is_local(path) and not has_second_link:
        with name_file_in_errors(path), path.open("a", encoding="utf-8") as file:
            file.write(f"{line}\n")
    else:
        content = read_bytes(path, kind) if path.exists() else b""
        write_atomically(path, content + f"{line}\n".encode())


@cache
def identify_machine() -> str:
    """Return a short text that differs between machines, also if they have the same name."""
    address = getnode()
    # Without a network, Python draws a random address in each process, and sets this bit in it.
    is_random = bool(address >> 40 & 1)
    name = f"{socket.gethostname()} {0 if is_random else address}"
    return sha256(name.encode()).hexdigest()[:8]


@contextmanager
def hold_partial(path: Path, *, is_folder: bool) -> Iterator[Path]:
    """Create and lock an empty temporary file or folder next to `path`, and remove it at the end.

    Raises OSError if the file or folder cannot be created.
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
        # Another process can remove the file before it is locked. Then the loop creates a new file.
        with suppress(FileNotFoundError):
            handle = os.open(partial_path, os.O_RDONLY if is_folder else os.O_RDWR)
            if try_lock(handle) is not False and _is_at(partial_path, handle):
                return partial_path, handle
            os.close(handle)


def try_lock(handle: int, *, is_exclusive: bool = True) -> bool | None:
    """Lock an open file or folder. Return False if the lock of another process excludes it.

    Returns None if the system or the file system has no locks.
    """
    if fcntl is None:
        return None
    mode = fcntl.LOCK_EX if is_exclusive else fcntl.LOCK_SH
    try:
        fcntl.flock(handle, mode | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return None
    return True


def _is_at(path: Path, handle: int) -> bool:
    """Return whether the open file is still the file at the path."""
    try:
        return os.path.samestat(path.lstat(), os.fstat(handle))
    except FileNotFoundError:
        return False


def remove_file(path: Path, folder: Path | None = None) -> None:
    """Remove a file of a study, if it exists. Raise as `require_inside_study`."""
    require_inside_study(path, folder)
    path.unlink(missing_ok=True)


def remove_tree(path: Path) -> None:
    """Remove a file or a folder, if it exists."""
    if path.is_dir():
        # Imported late, because the import takes time.
        import shutil

        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)


def remove_abandoned(directory: Path) -> None:
    """Remove the temporary files and folders in a folder that no process writes.

    A file remains if it cannot be opened, locked or removed.
    """
    if fcntl is None:
        return
    for folder, folder_names, file_names in os.walk(directory):
        partial_names = [
            name
            for name in (*folder_names, *file_names)
            if name.startswith(".") and name.endswith(PARTIAL_SUFFIX)
        ]
        # `os.walk` reads this list, and does not enter the removed folders.
        folder_names[:] = [name for name in folder_names if name not in partial_names]
        for name in partial_names:
            with suppress(OSError):
                _remove_if_abandoned(Path(folder, name))


def _remove_if_abandoned(path: Path) -> None:
    """Remove a temporary file that no process writes. Raise OSError if it cannot be locked."""
    handle = os.open(path, (os.O_RDONLY if path.is_dir() else os.O_RDWR) | OPEN_FLAGS)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        is_of_this_machine = f".{identify_machine()}-" in path.name
        age = time.time() - os.fstat(handle).st_mtime
        if is_of_this_machine or age > MAX_AGE_OF_OTHER_MACHINES:
            remove_tree(path)
    finally:
        os.close(handle)
