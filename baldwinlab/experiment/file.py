"""Data files as settings of a part. The SHA-256 of the content is part of the experiment."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from pydantic import BaseModel, Field, model_validator

from baldwinlab.core.errors import PartError
from baldwinlab.core.files import DATA_FILE, read_bytes
from baldwinlab.experiment.fields import Fields

HASH_DIGITS: Final = 12
"""Number of digits of a hash in messages."""


class File(Fields):
    """Data file of a part, for example a map or weights.

    In TOML, `--set` and Python, write the path of the file.
    The experiment computes the hash, which is stored and compared like other settings.
    `File()` means no file.
    """

    path: str = Field(
        "",
        max_length=1000,
        description="Path of a data file, relative to the working directory.",
    )
    sha256: str = Field(
        "",
        pattern="^([0-9a-f]{64})?$",
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
        return {**tree, "sha256": hashlib.sha256(_read_content(str(tree["path"]))).hexdigest()}

    def read(self) -> bytes:
        """Read the file.

        Raises
        ------
        PartError
            If the file cannot be read, or its content is not that of the experiment.
        """
        try:
            content = _read_content(self.path)
        except ValueError as error:
            raise PartError(str(error)) from None
        digest = hashlib.sha256(content).hexdigest()
        if digest != self.sha256:
            raise PartError(
                f"the file {self.path} has the SHA-256 {digest[:HASH_DIGITS]}..., and the "
                f"experiment was made with a file with {self.sha256[:HASH_DIGITS]}...: "
                "give that file again, or make another experiment"
            )
        return content


def iterate_files(table: BaseModel, path: str = "") -> Iterator[tuple[str, File]]:
    """Yield the path of each setting with a data file, and the file."""
    for name, value in table:
        entries = value if isinstance(value, tuple) else (value,)
        for entry in entries:
            if isinstance(entry, File) and entry.path:
                yield f"{path}{name}", entry
            elif isinstance(entry, BaseModel):
                yield from iterate_files(entry, f"{path}{name}.")


def require_files(experiment: Any, where: str) -> None:
    """Raise PartError if a data file of an experiment is missing or has changed."""
    for member in experiment.species_experiments():
        require_files(member, where)
    for path, file in iterate_files(experiment):
        try:
            file.read()
        except PartError as error:
            raise PartError(f"{path} of {experiment.name}{where}: {error}") from None


def _read_content(path: str) -> bytes:
    try:
        return read_bytes(Path(path), DATA_FILE)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise ValueError(f"the file {path} cannot be read: {reason}") from None
