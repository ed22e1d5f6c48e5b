"""Checks of paths, and functions that read local and remote files up to a size limit."""

from __future__ import annotations

import errno
import json
import os
import shlex
import tomllib
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path, PosixPath, WindowsPath
from typing import IO, Any, Final, NamedTuple, cast
from urllib.parse import urlsplit

from baldwinlab.core.errors import RefusedError
from baldwinlab.core.extras import missing_extra_error

MAX_JSON_DEPTH: Final = 32
# Suffix of the temporary name of a file during its write.
PARTIAL_SUFFIX: Final = ".partial"
# A folder with a file of this name is a study.
STUDY_FILE_NAME: Final = "study.toml"
# Extra that the protocol of a URL needs (others need "cluster"), and the modules of these extras.
EXTRA_OF_PROTOCOL: Final = {"s3": "s3", "s3a": "s3"}
STORAGE_MODULES: Final = {"s3": ("upath", "s3fs"), "cluster": ("upath",)}

# Text by which a command recognizes the files that it may overwrite. `replay` writes traces,
# pictures and movies, `export` writes pages that simulate, and `freeze` writes genome files.
REPLAY_MARK: Final = "baldwinlab replay"
REPORT_MARK: Final = "baldwinlab report"
EXPORT_MARK: Final = "baldwinlab export"
FREEZE_MARK: Final = "baldwinlab freeze"
_STUDY_ENTRIES: Final = (
    "runs",
    "parts",
    "inputs",
    "founders",
    "assays",
    "paper",
    STUDY_FILE_NAME,
    "sessions.jsonl",
)
# Number of bytes at the beginning and at the end of a file in which a mark is searched.
_MARK_RANGE: Final = 65536


class FileKind(NamedTuple):
    """A kind of file that is read into memory, with the limit of its size in bytes."""

    name: str
    max_bytes: int


EXPERIMENT_FILE: Final = FileKind("the TOML file of an experiment", 2 * 2**20)
STUDY_FILE: Final = FileKind(STUDY_FILE_NAME, 8 * 2**20)
SWEEP_FILE: Final = FileKind("the TOML file of a sweep", 2 * 2**20)
PAPER_FILE: Final = FileKind("a file of a paper", 8 * 2**20)
PART_FILE: Final = FileKind("a Python file with parts", 4 * 2**20)
DATA_FILE: Final = FileKind("a data file of a part", 2**30)
SESSIONS_FILE: Final = FileKind("sessions.jsonl", 64 * 2**20)
RESULTS_FILE: Final = FileKind("a JSON file of results", 256 * 2**20)
REPORT_FILE: Final = FileKind("a report", 256 * 2**20)
# A variable of netCDF has at most 2 GiB.
ASSAY_FILE: Final = FileKind("an assay", 4 * 2**30)


def parse_toml(text: str) -> dict[str, Any]:
    """Return the tables of a TOML text, or raise tomllib.TOMLDecodeError."""
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise tomllib.TOMLDecodeError("it is nested too deeply") from None


def parse_json(text: str | bytes) -> Any:
    """Return the value of a JSON text. Raise ValueError if it is invalid or nested too deeply."""
    try:
        value = json.loads(text)
        # The values at one depth. After the loop, this depth is greater than allowed.
        level = [value]
        for _ in range(MAX_JSON_DEPTH):
            level = [child for parent in level for child in _list_children(parent)]
        is_too_deep = bool(level)
    except RecursionError:
        is_too_deep = True
    if is_too_deep:
        raise ValueError(f"JSON may have {MAX_JSON_DEPTH} nested levels; this text has more")
    return value


def _list_children(value: Any) -> Iterable[Any]:
    if isinstance(value, dict):
        return value.values()
    return value if isinstance(value, list) else ()


def read_json(path: Path, remedy: str = "Remove the file.") -> Any:
    """Return the value of a JSON file of results. Raise RefusedError if it cannot be read."""
    try:
        return parse_json(read_text(path, RESULTS_FILE))
    except (OSError, ValueError) as error:
        raise RefusedError(f"{path} cannot be read: {error}. {remedy}") from None


def parse_location(text: str | Path) -> Path:
    """Return the path for a text, which is a local path or a URL such as s3://bucket/study.

    For a URL of remote storage, the result is a UPath, which has the methods of a Path.
    """
    if isinstance(text, PosixPath | WindowsPath) or "://" not in str(text):
        return Path(text)
    if str(text).startswith("file://"):
        # Imported late, because the import takes time.
        from urllib.request import url2pathname

        return Path(url2pathname(urlsplit(str(text)).path))
    protocol = str(text).partition("://")[0]
    extra = EXTRA_OF_PROTOCOL.get(protocol, "cluster")
    if not all(find_spec(name) for name in STORAGE_MODULES[extra]):
        raise missing_extra_error(extra, str(text))
    from upath import UPath

    try:
        # Remote workers also write into this storage, so lists of files must not be cached.
        path = UPath(text, use_listings_cache=False)
        # This call only checks whether the storage answers.
        path.exists()
    except Exception as error:
        # Each kind of storage raises its own errors.
        raise RefusedError(f"{text} cannot be reached: {' '.join(str(error).split())}") from None
    return cast(Path, path)


def make_remote_folder(path: Path) -> None:
    """Create a folder in remote storage. An object store has no folders, so nothing is created."""
    from upath.implementations.cloud import CloudPath

    # In an object store, `mkdir` would create a missing bucket.
    if not isinstance(path, CloudPath):
        path.mkdir(parents=True, exist_ok=True)


def require_cluster_extra(feature: str) -> None:
    """Raise RefusedError for a feature if the extra `cluster` is not installed."""
    if not all(find_spec(name) for name in ("upath", "distributed", "dask_jobqueue")):
        raise missing_extra_error("cluster", feature)


def open_file(path: Path) -> IO[bytes]:
    """Open a regular file for reading. Raise ValueError for a folder, a device or a pipe."""
    if not is_local(path):
        return path.open("rb")
    if path.exists() and not path.is_file():
        raise ValueError("it is not a regular file")
    # With O_NONBLOCK, a pipe that has replaced the file since the check does not block.
    flags = getattr(os, "O_BINARY", 0) | getattr(os, "O_NONBLOCK", 0)
    return os.fdopen(os.open(path, os.O_RDONLY | flags), "rb")


def read_bytes(path: Path, kind: FileKind) -> bytes:
    """Return the content of a file. Raise ValueError if the file is too large or not regular."""
    with open_file(path) as file:
        size = _measure_size(file, kind)
        file.seek(0)
        return file.read(size)


def require_size(path: Path, kind: FileKind) -> None:
    """Raise ValueError if a file is too large or not regular, before it is sent in pieces."""
    with open_file(path) as file:
        _measure_size(file, kind)


def _measure_size(file: IO[bytes], kind: FileKind) -> int:
    # `seek` returns the size. In remote storage, this saves the request for the properties.
    size = file.seek(0, os.SEEK_END)
    if size > kind.max_bytes:
        raise ValueError(
            f"it has {size:,} bytes, and {kind.name} may have at most {kind.max_bytes:,}"
        )
    return size


def read_text(path: Path, kind: FileKind) -> str:
    """Return the text of a UTF-8 file with line feeds, and without a byte order mark.

    Raises as `read_bytes`, and ValueError for other encodings.
    """
    try:
        # Editors on Windows begin a file with a byte order mark.
        text = read_bytes(path, kind).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise ValueError("it is not UTF-8 text") from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


def list_names(folder: Path) -> dict[str, bool]:
    """Return whether each entry of a folder is a file, by name. Raise OSError as `iterdir` does."""
    if not is_local(folder):
        # An object store has no folders.
        return {path.name: True for path in folder.iterdir()}
    # `scandir` is much faster than a path and a system call for each file.
    with os.scandir(folder) as entries:
        return {entry.name: entry.is_file() for entry in entries}


def find_paths(folder: Path, pattern: str) -> list[Path]:
    """Return the sorted paths below a folder that match a pattern, such as "**/*.nc".

    Links to folders are not followed. Without the folder, the list is empty.
    """
    return sorted(folder.glob(pattern))


def walk_folders(root: Path) -> Iterator[tuple[Path, list[str], list[str]]]:
    """Yield each folder, the sorted names of its folders, and the names of its files.

    Hidden folders and links are not followed. The caller can remove names of folders to skip them.
    """
    for folder, subfolders, names in os.walk(root):
        subfolders[:] = sorted(name for name in subfolders if not name.startswith("."))
        yield Path(folder), subfolders, names


def read_change_time(path: Path) -> int:
    """Return the modification time of a file in nanoseconds, -1 if the file does not exist."""
    try:
        return path.stat().st_mtime_ns
    except FileNotFoundError:
        return -1


def is_local(path: Path) -> bool:
    """Return whether a path is in the local file system, and not in remote storage."""
    # Before version 0.3 of universal-pathlib, a UPath is also a Path, but not one of these types.
    return isinstance(path, PosixPath | WindowsPath)


def make_absolute(path: Path) -> Path:
    """Return a local path as an absolute path, so that it remains valid in another directory."""
    # `absolute` does not remove "..", because a link before ".." leads to another parent folder.
    return path.absolute() if is_local(path) else path


def shorten_path(path: Path) -> Path:
    """Return a path relative to the working directory for a message, if it is inside."""
    try:
        return path.relative_to(Path.cwd()) if is_local(path) else path
    except (OSError, ValueError):
        # The path is outside, or the working directory was removed.
        return path


def quote_path(path: Path) -> str:
    """Return a path as an argument of a command in the working directory, quoted for a shell."""
    return shlex.quote(str(shorten_path(path)))


def require_inside_study(path: Path, folder: Path | None = None) -> None:
    """Raise RefusedError if a link would lead a write out of a study.

    `folder`: by default, every folder above `path` that holds a study is checked.
    """
    if not is_local(path):
        return
    absolute = path.absolute()
    target = Path(os.path.realpath(absolute.parent))
    studies = [folder.absolute()] if folder else _find_studies_above(absolute)
    for study in studies:
        if not target.is_relative_to(os.path.realpath(study)):
            parents = [study / parent for parent in absolute.relative_to(study).parents]
            # The last of the parents is the study itself. The message names the outermost link.
            folders_inside = reversed(parents[:-1])
            link = next(parent for parent in folders_inside if parent.is_symlink())
            raise RefusedError(
                f"{path} cannot be written: {link} is a link that leads out of the study {study}. "
                "Remove the link."
            )


def _find_studies_above(path: Path) -> Iterator[Path]:
    """Yield the folders above a path that hold a study. Links are not followed."""
    for folder in path.parents:
        if ".." not in path.relative_to(folder).parts and (folder / STUDY_FILE_NAME).exists():
            yield folder


def require_writable(
    option: str, path: Path, mark: bytes, *, force: bool, suffixes: Sequence[str] = ()
) -> None:
    """Raise RefusedError if a command must not write a file.

    - `path`: path in an existing folder, but not inside a study.
    - `mark`: bytes that all files of this command contain. A file without `mark` is refused.
    - `force`: accept an existing file without `mark`.
    - `suffixes`: allowed ends of the name, by default all.
    """
    if not path.parent.is_dir():
        raise RefusedError(
            f"{option} {path}: the folder {path.parent} does not exist. Create it or choose "
            "another path."
        )
    if folder := enclosing_study(path):
        raise RefusedError(f"{option} {path} is inside the study {folder}. Choose another path.")
    if suffixes and path.suffix not in suffixes:
        endings = " or ".join(", ".join(suffixes).rsplit(", ", 1))
        raise RefusedError(f"{option} {path} must end in {endings}")
    if path.is_dir():
        raise RefusedError(f"{option} {path} is a folder. Give the path of a file.")
    require_no_device(path)
    if path.exists() and not force and not has_mark(path, mark):
        raise RefusedError(
            f"{option} {path} exists and was not written by this command. Choose another path or "
            "add --force."
        )


def require_no_device(path: Path) -> None:
    """Raise RefusedError for a device or a pipe, which a write would replace for all programs."""
    if path.exists() and not (path.is_file() or path.is_dir()):
        raise RefusedError(f"{path} is a device or a pipe. Give the path of a file.")


def is_study(folder: Path) -> bool:
    """Return whether a folder holds a study, possibly damaged. `study.toml` is written last."""
    return (folder / STUDY_FILE_NAME).exists()


def enclosing_study(path: Path) -> Path | None:
    """Return the folder of the study that contains a path, or None. Links are followed."""
    real_path = path.resolve()
    for folder in real_path.parents:
        entry = real_path.relative_to(folder).parts[0]
        if entry in _STUDY_ENTRIES and is_study(folder):
            return folder
    return None


def has_mark(path: Path, mark: bytes) -> bool:
    """Return whether a file is empty or has a mark near one of its ends."""
    with open_file(path) as file:
        size = file.seek(0, os.SEEK_END)
        file.seek(0)
        start = file.read(_MARK_RANGE)
        file.seek(max(0, size - _MARK_RANGE))
        return size == 0 or mark in start or mark in file.read()


@contextmanager
def name_file_in_errors(path: Path) -> Iterator[None]:
    """Add the path to an OSError of this context. For a full disk, also add the folder."""
    try:
        yield
    except OSError as error:
        is_full = error.errno in (errno.ENOSPC, errno.EDQUOT)
        reason = error.strerror or str(error)
        if is_full:
            reason = f"no space is left in {path.parent}"
        name = str(error.filename or path)
        if is_full or name.endswith(PARTIAL_SUFFIX):
            name = str(path)
        raise OSError(error.errno, reason, name) from None
