"""Access to the studies in the folder of a lab. Paths outside the folder are rejected."""

from __future__ import annotations

import os
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path

from baldwinlab.experiment import Experiment
from baldwinlab.lab import Lab, MissingError
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore


def list_study_names(root: Path) -> Iterator[str]:
    """Yield the paths of all studies in a folder, relative to it. "." is the folder itself.

    Links to folders are not followed.
    """
    for folder, subfolders, files in os.walk(root):
        if "study.toml" in files:
            yield Path(folder).relative_to(root).as_posix()
        subfolders[:] = sorted(
            name for name in subfolders if name != "runs" and not name.startswith(".")
        )


def find_study(lab: Lab, name: str) -> StudyStore:
    """Return the study of this name.

    Raise MissingError if it does not exist, and StudyError if it is outside the served folder or
    cannot be read.
    """
    path = lab.root / name / "study.toml"
    try:
        modified = path.stat().st_mtime_ns
    except (OSError, ValueError):
        # ValueError: the name is not valid for a file.
        raise MissingError(f"there is no study {name!r} in {lab.root}") from None
    for part in (path.parent, path, path.parent / "runs"):
        require_inside(lab.root, part)
    return _open_study(lab.root, path.parent.resolve(), modified)


@lru_cache(maxsize=16)
def _open_study(root: Path, directory: Path, modified: int) -> StudyStore:
    """Open a study and cache it until `study.toml` is modified.

    A study of thousands of conditions takes seconds to open.
    """
    try:
        study = StudyStore(directory)
    except (TypeError, ValueError) as error:
        # The file is valid TOML, but not a study.
        raise StudyError(f"{directory} cannot be read: {error}") from None
    for name in study.experiments:
        require_inside(root, directory / "runs" / name)
    return study


def require_inside(root: Path, path: Path) -> None:
    """Raise StudyError if a path, after resolving links, is outside the served folder."""
    if not path.resolve().is_relative_to(root):
        raise StudyError(f"{path} is outside {root}, the folder of this lab")


def find_condition(study: StudyStore, name: str) -> Experiment:
    """Return a condition of a study. Raise MissingError if it does not exist."""
    try:
        return study.experiment(name)
    except StudyError as error:
        raise MissingError(str(error)) from None


def require_run(lab: Lab, study: StudyStore, name: str, run: int) -> None:
    """Raise MissingError if a run is not stored."""
    runs = study.runs(name)
    if run not in runs:
        stored = (
            f"{len(runs)} runs are stored, from {runs[0]} to {runs[-1]}"
            if runs
            else "no run is stored yet"
        )
        raise MissingError(f"{study.directory} has no run {run} of {name}; {stored}")
    require_inside(lab.root, study.path(name, run))
