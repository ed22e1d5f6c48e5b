"""Functions that write a file completely or not at all, locally and in remote storage.

The package writes every file with `atomic_path`, `write_atomically`, `write_json`,
`write_exclusively` or `append_line`. These functions do not follow a link that leads out of a
study.
"""

from __future__ import annotations

import errno
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from baldwinlab.core.errors import RefusedError
from baldwinlab.core.files import (
    FileKind,
    is_local,
    make_remote_folder,
    name_file_in_errors,
    read_bytes,
    require_inside_study,
)
from baldwinlab.core.partial_files import hold_partial


def require_writable_path(path: Path) -> None:
    """Raise RefusedError if a file cannot be written, before its content is computed."""
    if not is_local(path):
        return
    require_inside_study(path)
    parents = (path, *path.absolute().parents)
    existing_path = next(parent for parent in parents if parent.exists())
    folder = existing_path if existing_path.is_dir() else existing_path.parent
    if not (os.access(folder, os.W_OK) and os.access(existing_path, os.W_OK)):
        raise RefusedError(
            f"{path} cannot be written: {existing_path} is read-only. Copy the study to a folder "
            "that can be written, and use the copy."
        )


@contextmanager
def atomic_path(path: Path, *, exclusive: bool = False, is_folder: bool = False) -> Iterator[Path]:
    """Yield the path of an empty temporary file, and rename it to `path` at the end.

    - `path`: the final path. Its folder is created if it does not exist.
    - `exclusive`: raise FileExistsError if `path` exists at the end.
    - `is_folder`: create a folder instead of a file.
    """
    require_inside_study(path)
    if path.exists() and not (path.is_file() or path.is_dir()):
        # The renamed file would replace the device for all programs.
        raise RefusedError(f"{path} is a device or a pipe. Give the path of a file.")
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
    """Give a file the name `path`; raise FileExistsError if another process has created it."""
    try:
        os.link(partial_path, path)
    except FileExistsError:
        raise
    except OSError:
        # The file system has no hard links.
        with path.open("xb") as file:
            file.write(partial_path.read_bytes())


def write_atomically(path: Path, content: bytes) -> Path:
    """Write a file completely or not at all. Raise as `atomic_path` does."""
    if is_local(path):
        with atomic_path(path) as partial_path, partial_path.open("wb") as file:
            file.write(content)
    else:
        with name_file_in_errors(path):
            make_remote_folder(path.parent)
            # In remote storage a write is atomic, and a rename is not.
            path.write_bytes(content)
    return path


def write_json(path: Path, content: object) -> Path:
    """Write JSON completely or not at all.

    Raise ValueError for NaN, and as `write_atomically` does.
    """
    text = json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False)
    return write_atomically(path, f"{text}\n".encode())


def write_exclusively(path: Path, content: bytes) -> None:
    """Write a file that must not exist yet. One of several processes succeeds.

    All other processes raise FileExistsError. Other errors are those of `atomic_path`. If remote
    storage has no exclusive creation, the function reads the file again after the write. It raises
    FileExistsError if another process has overwritten the file.
    """
    if is_local(path):
        with atomic_path(path, exclusive=True) as partial_path, partial_path.open("wb") as file:
            file.write(content)
        return
    conflict = FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(path))
    try:
        make_remote_folder(path.parent)
        with path.open("xb") as file:
            file.write(content)
    except FileExistsError:
        raise conflict from None
    except (ValueError, NotImplementedError):
        # The storage has no exclusive creation.
        if path.exists():
            raise conflict from None
        write_atomically(path, content)
        if path.read_bytes() != content:
            raise conflict from None


def append_line(path: Path, line: str, kind: FileKind) -> None:
    """Append a line to a file. Raise as `atomic_path`, and RefusedError if the file is a link.

    A file in remote storage cannot grow, so the function writes the complete file again. It also
    writes a file with a second hard link again, because the content of that link must not change.
    """
    require_inside_study(path)
    if is_local(path) and path.is_symlink():
        raise RefusedError(f"{path} cannot be written: it is a link. Remove it.")
    has_second_link = is_local(path) and path.exists() and path.stat().st_nlink > 1
    if is_local(path) and not has_second_link:
        with name_file_in_errors(path), path.open("a", encoding="utf-8") as file:
            file.write(f"{line}\n")
    else:
        content = read_bytes(path, kind) if path.exists() else b""
        write_atomically(path, content + f"{line}\n".encode())
