"""Where a command may write: never over what makes a study, and over another file only where nothing is lost."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from baldwinlab.core.errors import RefusedError
from baldwinlab.core.files import STUDY

REPLAY: Final = "baldwinlab replay"  # what stands in every trace, picture and movie that is written
REPORT: Final = "baldwinlab report"  # and in every page of a study
EXPORT: Final = "baldwinlab export"  # in every live laboratory
_OF_A_STUDY: Final = ("runs", "parts", "assays", "paper", STUDY, "sessions.jsonl")
_LOOKED_AT: Final = 65536  # bytes at each end of a file


def require_writable(option: str, path: Path, mark: bytes, *, force: bool) -> None:
    """Raises RefusedError where to write a file would lose another.

    That is, where its folder is not there; where it belongs to a study; and, unless forced, where there is a file in which
    `mark` does not stand, and it does in whatever the command writes.
    """
    if not path.parent.is_dir():
        raise RefusedError(f"{option} {path}: there is no folder {path.parent}")
    if folder := owner(path):
        raise RefusedError(f"{option} {path} belongs to the study in {folder}: choose another name")
    if path.is_dir():
        raise RefusedError(f"{option} {path} is a folder: give the name of a file")
    if path.exists() and not force and not _bears(path, mark):
        why = "is there already, and not made by this command"
        raise RefusedError(f"{option} {path} {why}: choose another name, or add --force")


def is_study(folder: Path) -> bool:
    """Whether a folder holds a study, readable or not: its `study.toml` is written last of all."""
    return (folder / STUDY).exists()


def owner(path: Path) -> Path | None:
    """The folder of the study that a file or folder is a part of, links followed; None where it is of none."""
    real = path.resolve()
    for folder in real.parents:
        if real.relative_to(folder).parts[0] in _OF_A_STUDY and is_study(folder):
            return folder
    return None


def _bears(path: Path, mark: bytes) -> bool:
    """Whether a file is empty, or a mark stands near one of its ends."""
    size = path.stat().st_size
    with path.open("rb") as file:
        begin = file.read(_LOOKED_AT)
        file.seek(max(0, size - _LOOKED_AT))
        return size == 0 or mark in begin or mark in file.read()
