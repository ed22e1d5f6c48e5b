"""Files that appear whole or not at all, in a folder or at any location that fsspec reaches."""

from __future__ import annotations

import errno
import json
import os
import tomllib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final, cast
from urllib.parse import urlsplit
from uuid import uuid4

from baldwinlab.errors import RefusedError
from baldwinlab.extras import missing_extra

DEEPEST: Final = 32  # levels of JSON
PARTIAL = ".partial"  # the ending of a file that is being written


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
        place = UPath(text, use_listings_cache=False)  # workers elsewhere write there too, so nothing stays as it was listed
        place.exists()
    except Exception as error:  # every kind of store has faults of its own
        raise RefusedError(f"{text} cannot be reached: {' '.join(str(error).split())}") from None
    return cast(Path, place)


def require_cluster_extra(what: str) -> None:
    """Raises RefusedError, with a sentence for the user, where the extra `cluster` is not installed."""
    if not all(find_spec(name) for name in ("upath", "distributed", "dask_jobqueue")):
        raise missing_extra("cluster", what)


def text_of(path: Path) -> str:
    """Raises OSError, and ValueError for what is no file, such as a named pipe, of which the end may never come."""
    if is_local(path) and path.exists() and not path.is_file():
        raise ValueError("it is no file")
    return path.read_text("utf-8")


def is_local(path: Path) -> bool:
    """Whether a path lies in this machine's file system, rather than in a store that only fsspec reaches."""
    return isinstance(path, Path)


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Whatever cannot be written in here is said of this file; and where no space is left, in which folder that is."""
    try:
        yield
    except OSError as error:
        full = error.errno in (errno.ENOSPC, errno.EDQUOT)
        why = f"no space is left in {path.parent}" if full else error.strerror or str(error)
        raise OSError(error.errno, why, str(path) if full else error.filename or str(path)) from None


@contextmanager
def appearing(path: Path) -> Iterator[Path]:
    """Where to write a file or folder of this machine, under another name in the same folder, made where it is missing.

    At the end it is renamed. Raises OSError, leaving no trace.
    """
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        partial = path.with_name(f".{path.name}.{uuid4().hex}{PARTIAL}")
        try:
            yield partial
            if partial.is_file():
                with partial.open("rb+") as file:
                    os.fsync(file.fileno())
            partial.replace(path)
        except BaseException:
            if partial.is_dir():
                import shutil  # here, because to load it takes a while

                shutil.rmtree(partial, ignore_errors=True)
            else:
                partial.unlink(missing_ok=True)
            raise


def write_atomically(path: Path, content: bytes) -> Path:
    """Write a file whole or not at all. Raises OSError as `appearing` does."""
    if is_local(path):
        with appearing(path) as partial, partial.open("xb") as file:
            file.write(content)
    else:
        with writing(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)  # an object appears with its last byte: a put to a store is atomic, a rename is not
    return path


def append_line(path: Path, line: str) -> None:
    """Add a line to a file. An object cannot grow, so elsewhere than in a file system it is put again."""
    if is_local(path):
        with writing(path), path.open("a", encoding="utf-8") as file:
            file.write(line + "\n")
    else:
        before = path.read_text("utf-8") if path.exists() else ""
        write_atomically(path, f"{before}{line}\n".encode())
