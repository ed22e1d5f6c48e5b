"""Checks of output paths and names: no overwritten file, and names for every operating system."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Final

from baldwinlab.core.errors import RefusedError
from baldwinlab.core.files import STUDY_FILE_NAME

# Marks in the files that the commands write: traces, pictures and movies; reports; pages that
# simulate; genome files.
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
# Number of bytes at each end of a file that may hold the mark.
_MARK_RANGE: Final = 65536


def require_writable(option: str, path: Path, mark: bytes, *, force: bool) -> None:
    """Raise RefusedError if a command must not write a file.

    - `path`: its folder must exist, and it must not be inside a study.
    - `mark`: bytes that all files of this command contain. An existing file without them is
      refused.
    - `force`: accept an existing file without `mark`.
    """
    if not path.parent.is_dir():
        raise RefusedError(
            f"{option} {path}: the folder {path.parent} does not exist. Create it or choose "
            "another path."
        )
    if folder := enclosing_study(path):
        raise RefusedError(f"{option} {path} is inside the study {folder}. Choose another path.")
    if path.is_dir():
        raise RefusedError(f"{option} {path} is a folder. Give the path of a file.")
    if path.exists() and not force and not has_mark(path, mark):
        raise RefusedError(
            f"{option} {path} exists and was not written by this command. Choose another path or "
            "add --force."
        )


def is_study(folder: Path) -> bool:
    """Return whether a folder holds a study, possibly damaged. `study.toml` is its last file."""
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
    size = path.stat().st_size
    with path.open("rb") as file:
        start = file.read(_MARK_RANGE)
        file.seek(max(0, size - _MARK_RANGE))
        return size == 0 or mark in start or mark in file.read()


# Windows reserves these names, also with an ending, for devices.
DEVICE_NAMES: Final = frozenset(
    {"con", "prn", "aux", "nul"}
    | {f"{port}{number}" for port in ("com", "lpt") for number in range(10)}
)


def find_name_fault(name: str) -> str:
    """Return why a name cannot be a file on every operating system, or ""."""
    for folder in name.split("/"):
        if folder.partition(".")[0].casefold() in DEVICE_NAMES:
            return f"Windows reserves {folder!r} for a device"
        if folder.endswith((".", " ")):
            return f"Windows removes the dot or space at the end of {folder!r}"
    return ""


def find_case_collision(names: Iterable[str]) -> tuple[str, str] | None:
    """Return two names that are one file on macOS and Windows, which ignore case; None if none."""
    name_by_folded: dict[str, str] = {}
    for name in names:
        first_name = name_by_folded.setdefault(name.casefold(), name)
        if first_name != name:
            return first_name, name
    return None
