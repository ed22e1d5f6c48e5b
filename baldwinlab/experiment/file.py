"""Data files as settings of a part.

A file is identified by the SHA-256 of its content, which is a setting. The path is only the name
that the user gave. A text has the same hash with all kinds of line endings, and with or without a
byte order mark.

The process stores where it has read each content: at the absolute path of a given file, in a study,
or in memory. So an experiment can be simulated after a change of the working directory, and a study
can be moved.
"""

from __future__ import annotations

import codecs
import hashlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path, PurePath
from typing import Any, Final

from pydantic import Field, model_validator

from baldwinlab.core.errors import PartError
from baldwinlab.core.files import DATA_FILE, make_absolute, parse_location, read_bytes
from baldwinlab.core.names import SHA256
from baldwinlab.experiment.fields import Fields

_PATHS: Final[dict[str, Path]] = {}
"""Absolute path of each known content, by SHA-256. Each reading compares the hash again."""
_CONTENTS: Final[dict[str, bytes]] = {}
"""Contents in memory, by SHA-256. `hold_contents` adds them."""


class File(Fields):
    """Data file of a part, for example a map or weights.

    In TOML, `--set` and Python, write the path of the file.
    The experiment computes the hash, which is stored and compared like other settings.
    `File()` means no file.

    Attributes
    ----------
    path : str
        Path of the file, relative to the working directory.
    sha256 : str
        SHA-256 of the content.
    """

    path: str = Field(
        "",
        max_length=1000,
        description="Path of a data file, relative to the working directory.",
    )
    sha256: str = Field(
        "",
        pattern=SHA256,
        description="SHA-256 of the content, computed by baldwinlab.",
    )

    @model_validator(mode="before")
    @classmethod
    def _fill_in_hash(cls, value: Any, info: Any) -> Any:
        tree = {"path": str(value)} if isinstance(value, str | Path) else value
        is_lenient = (info.context or {}).get("lenient")
        if is_lenient or not isinstance(tree, dict):
            return tree
        has_hash = bool(tree.get("sha256"))
        if has_hash or not tree.get("path"):
            return tree
        path = parse_location(str(tree["path"]))
        digest = hash_content(_read_content(path, str(tree["path"])))
        remember_path(digest, path)
        return {**tree, "sha256": digest}

    def read(self) -> bytes:
        """Read the file. A text has line feeds as line endings, and no byte order mark.

        Raises
        ------
        PartError
            If the file cannot be read, or its content is not that of the experiment.
        """
        if self.sha256 in _CONTENTS:
            return _CONTENTS[self.sha256]
        known_path = _PATHS.get(self.sha256)
        paths = [*([known_path] if known_path else []), parse_location(self.path)]
        problem = f"the file {self.path} has changed since the experiment was made"
        for path in paths:
            try:
                content = _read_content(path, self.path)
            except ValueError as error:
                problem = str(error)
                continue
            if hash_content(content) == self.sha256:
                return normalize_text(content)
            problem = f"the file {self.path} has changed since the experiment was made"
        raise PartError(f"{problem}; give the original file")


def hash_content(content: bytes) -> str:
    """Return the SHA-256 of a content. The hash identifies a data file."""
    return hashlib.sha256(normalize_text(content)).hexdigest()


def normalize_text(content: bytes) -> bytes:
    """Return a text with line feeds and without a byte order mark, and other content unchanged."""
    if b"\0" in content:
        return content
    try:
        content.decode()
    except UnicodeDecodeError:
        return content
    text = content.removeprefix(codecs.BOM_UTF8)
    return text.replace(b"\r\n", b"\n").replace(b"\r", b"\n")


def remember_path(sha256: str, path: Path) -> None:
    """Store the absolute path of the content with a hash."""
    _PATHS[sha256] = make_absolute(path)


@contextmanager
def hold_contents(contents: Iterable[bytes]) -> Iterator[None]:
    """Make `File.read` return contents that are not in a file, while the context is open."""
    held = {hash_content(content): content for content in contents}
    _CONTENTS.update(held)
    try:
        yield
    finally:
        for sha256 in held:
            _CONTENTS.pop(sha256, None)


def iterate_file_tables(tree: Any, path: str = "") -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the path and the table of each data file in `tree`, the plain data of an experiment."""
    if isinstance(tree, dict) and tree.get("path") and tree.get("sha256"):
        yield path.removesuffix("."), tree
        return
    children: Iterable[tuple[Any, Any]]
    children = tree.items() if isinstance(tree, dict) else enumerate(tree)
    for name, value in children:
        if isinstance(value, dict | list):
            yield from iterate_file_tables(value, f"{path}{name}.")


def find_files(tree: Any, folders: Iterable[Path]) -> None:
    """Store the paths of the data files in `tree` that are in one of the folders.

    The folder of a study has copies of data files, see `baldwinlab.studies.study_file`.
    """
    folders = list(folders)
    for _, table in iterate_file_tables(tree):
        given_path = PurePath(table["path"])
        if given_path.is_absolute():
            continue
        candidates = (folder / given_path for folder in folders)
        path = next((path for path in candidates if path.exists()), None)
        if path is not None:
            remember_path(table["sha256"], path)


def find_paths(tree: Any) -> dict[str, str]:
    """Return the stored path of each data file in `tree`, by SHA-256."""
    hashes = {table["sha256"] for _, table in iterate_file_tables(tree)}
    return {sha256: str(_PATHS[sha256]) for sha256 in hashes & _PATHS.keys()}


def require_files(experiment: Any, where: str) -> None:
    """Raise PartError if a data file is missing or has changed. `where`: text for the message."""
    for path, table in iterate_file_tables(experiment.to_dict()):
        try:
            File(path=table["path"], sha256=table["sha256"]).read()
        except PartError as error:
            raise PartError(f"{path} of {experiment.name}{where}: {error}") from None


def _read_content(path: Path, name: str) -> bytes:
    try:
        return read_bytes(path, DATA_FILE)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise ValueError(f"the file {name} cannot be read: {reason}") from None
