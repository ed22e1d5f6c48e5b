"""Files: read up to the size of their kind, and written whole or not at all, at any location that fsspec reaches.

Every file of the package is written by `appearing`, `write_atomically`, `write_exclusively` or
`append_line`. These follow no link that leads out of a study.
"""

from __future__ import annotations

import errno
import json
import os
import tomllib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final, NamedTuple, cast
from urllib.parse import urlsplit
from uuid import uuid4

from baldwinlab.core.errors import RefusedError
from baldwinlab.core.extras import missing_extra

DEEPEST: Final = 32  # levels of JSON
PARTIAL = ".partial"  # the ending of a file that is being written
STUDY: Final = "study.toml"  # the file that makes a study of a folder


class FileKind(NamedTuple):
    """A kind of file that is read whole, so that its size must be limited."""

    name: str
    limit: int  # bytes


EXPERIMENT_FILE: Final = FileKind("the TOML file of an experiment", 2 * 2**20)
STUDY_FILE: Final = FileKind(STUDY, 8 * 2**20)
SWEEP_FILE: Final = FileKind("the TOML file of a sweep", 2 * 2**20)
PAPER_FILE: Final = FileKind("a file of a paper", 8 * 2**20)
PART_FILE: Final = FileKind("a Python file with parts", 4 * 2**20)
DATA_FILE: Final = FileKind("a data file of a part", 2**30)
SESSIONS_FILE: Final = FileKind("sessions.jsonl", 64 * 2**20)
RESULTS_FILE: Final = FileKind("a JSON file of results", 256 * 2**20)
ASSAY_FILE: Final = FileKind("an assay", 4 * 2**30)  # netCDF holds at most 2 GiB of a variable


def toml_of(text: str) -> dict[str, Any]:
    """The tables of a TOML text. Raises tomllib.TOMLDecodeError, also where they are nested deeper than Python can read."""
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise tomllib.TOMLDecodeError("it is nested too deeply") from None


def json_of(text: str | bytes) -> Any:
    """What JSON says. Raises ValueError where it is none, and for what nests too deep to be anything that we know."""
    try:
        found = json.loads(text)
        level = [found]
        for _ in range(DEEPEST):
            level = [below for each in level for below in _inside(each)]
    except RecursionError:
        level = [None]
    if level:
        raise ValueError(f"JSON may nest {DEEPEST} levels deep here, and this nests deeper")
    return found


def _inside(value: Any) -> Iterable[Any]:
    return value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()


def location(text: str | Path) -> Path:
    """The place that a path or a URL such as s3://bucket/study names.

    A path and a file:// URL give a Path. Any other URL gives what `universal_pathlib` makes of it: no Path by type, but with
    the methods of one that this package uses. Raises RefusedError, with a sentence for the user, where it cannot be reached.
    """
    if isinstance(text, Path) or "://" not in str(text):
        return Path(text)
    if str(text).startswith("file://"):
        from urllib.request import url2pathname  # here, because to load it takes a while

        return Path(url2pathname(urlsplit(str(text)).path))
    require_cluster_extra(str(text))
    from upath import UPath

    try:
        place = UPath(
            text, use_listings_cache=False
        )  # workers elsewhere write there too, so nothing stays as it was listed
        place.exists()
    except Exception as error:  # every kind of store has faults of its own
        raise RefusedError(f"{text} cannot be reached: {' '.join(str(error).split())}") from None
    return cast(Path, place)


def require_cluster_extra(what: str) -> None:
    """Raises RefusedError, with a sentence for the user, where the extra `cluster` is not installed."""
    if not all(find_spec(name) for name in ("upath", "distributed", "dask_jobqueue")):
        raise missing_extra("cluster", what)


def read_bytes(path: Path, kind: FileKind) -> bytes:
    """Read a file whose size is checked first.

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If it is a pipe, device or folder, or larger than files of its kind may be. The text is
        part of a sentence, without the path.
    """
    if is_local(path) and path.exists() and not path.is_file():
        raise ValueError("it is no file")
    size = path.stat().st_size
    if size <= kind.limit:
        with path.open("rb") as file:
            return file.read(size)
    raise ValueError(f"it has {size:,} bytes, and {kind.name} may have at most {kind.limit:,}")


def text_of(path: Path, kind: FileKind) -> str:
    """Read a text file. Raises OSError, and ValueError as `read_bytes` does and for other text than UTF-8."""
    try:
        text = read_bytes(path, kind).decode()
    except UnicodeDecodeError:
        raise ValueError("it is not UTF-8 text") from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


def is_local(path: Path) -> bool:
    """Whether a path lies in this machine's file system, rather than in a store that only fsspec reaches."""
    return isinstance(path, Path)


def require_inside_study(path: Path, folder: Path | None = None) -> None:
    """Refuse a write that a link would lead out of a study.

    Parameters
    ----------
    path : Path
        The file or folder that is about to be written.
    folder : Path, optional
        The study. By default, every folder above `path` that holds a study is checked.

    Raises
    ------
    RefusedError
        If a folder between the study and `path` is a link to a place outside of the study.
    """
    if not is_local(path):
        return
    place = path.absolute()
    target = Path(os.path.realpath(place.parent))
    studies = [folder.absolute()] if folder else _studies_above(place)
    for study in studies:
        if not target.is_relative_to(os.path.realpath(study)):
            steps = [study / step for step in reversed(place.relative_to(study).parents)]
            link = next(step for step in steps[1:] if step.is_symlink())
            raise RefusedError(
                f"{path} cannot be written: {link} is a link that leads out of the study in {study}; remove the link"
            )


def require_place(path: Path) -> None:
    """Refuse a file that could not be written later, before anything is computed for it.

    Raises RefusedError as `require_inside_study` does, and where the file or the folder that it
    would lie in is read-only.
    """
    if not is_local(path):
        return
    require_inside_study(path)
    there = next(each for each in (path, *path.absolute().parents) if each.exists())
    if not os.access(there if there.is_dir() else there.parent, os.W_OK) or not os.access(
        there, os.W_OK
    ):
        raise RefusedError(
            f"{path} cannot be written: {there} is read-only here; copy the study to a folder that can "
            "be written, and use the copy"
        )


def _studies_above(place: Path) -> Iterator[Path]:
    """The folders with a study in which a path lies as it is written, its links not followed."""
    for folder in place.parents:
        if ".." not in place.relative_to(folder).parts and (folder / STUDY).exists():
            yield folder


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Whatever cannot be written in here is said of this file; and where no space is left, in which folder that is."""
    try:
        yield
    except OSError as error:
        full = error.errno in (errno.ENOSPC, errno.EDQUOT)
        why = f"no space is left in {path.parent}" if full else error.strerror or str(error)
        named = str(error.filename or path)
        name = str(path) if full or named.endswith(PARTIAL) else named
        raise OSError(error.errno, why, name) from None


@contextmanager
def appearing(path: Path, *, exclusive: bool = False) -> Iterator[Path]:
    """Give the name under which to write a file or folder of this machine; at the end it is renamed to `path`.

    The name lies in the same folder, which is made where it is missing. Where `exclusive`, `path`
    must not exist at the end. Raises OSError, leaving no trace, and RefusedError as
    `require_inside_study` does.
    """
    require_inside_study(path)
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        partial = path.with_name(f".{path.name}.{uuid4().hex}{PARTIAL}")
        try:
            yield partial
            if partial.is_file():
                with partial.open("rb+") as file:
                    os.fsync(file.fileno())
            if exclusive:
                _link(partial, path)
            else:
                partial.replace(path)
        finally:
            _remove(partial)


def _link(partial: Path, path: Path) -> None:
    """Give a file the name `path`. Of several processes one does, the others raise FileExistsError."""
    try:
        os.link(partial, path)
    except FileExistsError:
        raise
    except OSError:  # a file system without hard links
        with path.open("xb") as file:
            file.write(partial.read_bytes())


def _remove(partial: Path) -> None:
    if partial.is_dir():
        import shutil  # here, because to load it takes a while

        shutil.rmtree(partial, ignore_errors=True)
    else:
        partial.unlink(missing_ok=True)


def write_atomically(path: Path, content: bytes) -> Path:
    """Write a file whole or not at all. Raises as `appearing` does."""
    if is_local(path):
        with appearing(path) as partial, partial.open("xb") as file:
            file.write(content)
    else:
        with writing(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(
                content
            )  # an object appears with its last byte: a put to a store is atomic, a rename is not
    return path


def write_exclusively(path: Path, content: bytes) -> None:
    """Write a file that must not exist yet. Of several processes that try, one succeeds.

    Raises FileExistsError in the others, and as `appearing` does. A store that knows no exclusive
    creation is asked for the file before and after: two writers at the same moment see one content.
    """
    if is_local(path):
        with appearing(path, exclusive=True) as partial, partial.open("xb") as file:
            file.write(content)
        return
    taken = FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(path))
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("xb") as file:
            file.write(content)
    except FileExistsError:
        raise taken from None
    except (ValueError, NotImplementedError):  # the store knows no exclusive creation
        if path.exists():
            raise taken from None
        write_atomically(path, content)
        if path.read_bytes() != content:
            raise taken from None


def append_line(path: Path, line: str, kind: FileKind) -> None:
    """Add a line to a file. Raises as `appearing` does, and RefusedError where the file is a link.

    An object cannot grow, so elsewhere than in a file system the file is written again, and so is
    one that has another name elsewhere (a hard link), whose content must stay as it is.
    """
    require_inside_study(path)
    if is_local(path) and path.is_symlink():
        raise RefusedError(f"{path} cannot be written: it is a link; remove it")
    if is_local(path) and not (path.exists() and path.stat().st_nlink > 1):
        with writing(path), path.open("a", encoding="utf-8") as file:
            file.write(line + "\n")
    else:
        before = read_bytes(path, kind) if path.exists() else b""
        write_atomically(path, before + f"{line}\n".encode())
