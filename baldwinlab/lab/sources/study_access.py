"""Access to the studies in the folder of a lab. Paths outside the folder are rejected."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from functools import lru_cache
from pathlib import Path
from typing import Final

from baldwinlab.experiment import Experiment
from baldwinlab.lab import Lab, MissingError
from baldwinlab.lab.sources.query import Query, read_number, read_text
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore

MAX_CACHED_STUDIES: Final = 16


def list_study_names(root: Path) -> Iterator[str]:
    """Yield the paths of all studies in a folder, relative to it. "." is the folder itself.

    Links to folders are not followed.
    """
    for folder, subfolders, files in os.walk(root):
        if "study.toml" in files:
            yield Path(folder).relative_to(root).as_posix()
        # `os.walk` visits the folders that remain in this list, in this order.
        subfolders[:] = sorted(
            name for name in subfolders if name != "runs" and not name.startswith(".")
        )


def find_study(lab: Lab, name: str) -> StudyStore:
    """Return the study of this name."""
    path = lab.root / name / "study.toml"
    try:
        modification_time = path.stat().st_mtime_ns
    except (OSError, ValueError):
        # ValueError: the name is not valid for a file.
        raise MissingError(f"there is no study {name!r} in {lab.root}") from None
    for read_path in (path.parent, path, path.parent / "runs"):
        require_inside(lab.root, read_path)
    return _open_study(lab.root, path.parent.resolve(), modification_time)


@lru_cache(maxsize=MAX_CACHED_STUDIES)
def _open_study(root: Path, directory: Path, modification_time: int) -> StudyStore:
    """Open a study and cache it until the modification time of `study.toml` changes.

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


def read_versions(root: Path, paths: Iterable[Path]) -> tuple[tuple[Path, int], ...]:
    """Return the existing paths with their modification times, in nanoseconds."""
    paths = tuple(paths)
    for path in paths:
        require_inside(root, path)
    return tuple((path, path.stat().st_mtime_ns) for path in paths if path.exists())


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


def find_requested_condition(lab: Lab, query: Query) -> tuple[StudyStore, Experiment]:
    """Return the study and the condition that a query names."""
    study = find_study(lab, read_text(query, "study"))
    return study, find_condition(study, read_text(query, "condition"))


def find_run(lab: Lab, query: Query) -> tuple[StudyStore, Experiment, int]:
    """Return the study, the condition and the number of the stored run that a query names."""
    study, condition = find_requested_condition(lab, query)
    run = read_number(query, "run")
    require_run(lab, study, condition.name, run)
    return study, condition, run


def require_run(lab: Lab, study: StudyStore, name: str, run: int) -> None:
    """Raise MissingError if a run is not stored."""
    runs = study.runs(name)
    if run not in runs:
        stored_runs = "no run is stored yet"
        if runs:
            stored_runs = f"{len(runs)} runs are stored, from {runs[0]} to {runs[-1]}"
        raise MissingError(f"{study.location} has no run {run} of {name}; {stored_runs}")
    require_inside(lab.root, study.path(name, run))
