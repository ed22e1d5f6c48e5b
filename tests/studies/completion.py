"""Simulate the missing runs and assays of a study, without messages."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any

from baldwinlab.studies.assays.results import find_missing_assays
from baldwinlab.studies.assays.run import run_assays
from baldwinlab.studies.run import find_missing_runs, run_study
from baldwinlab.studies.store import StudyStore
from tests.small_studies import ignore_message, ignore_progress


def complete_runs(
    study: StudyStore, runs: int, workers: int = 1, log: Callable[[str], None] = ignore_message
) -> None:
    missing = find_missing_runs(study, runs, log)
    run_study(study, missing, workers, ignore_progress, ignore_message)


def complete_assays(
    study: StudyStore, names: Sequence[str], workers: int = 1, **options: Any
) -> None:
    missing = find_missing_assays(study, names)
    run_assays(study, missing, workers, ignore_progress, ignore_message, **options)


def count_progress(
    step_counts: list[int],
) -> Callable[[str, int], AbstractContextManager[Callable[[int], None]]]:
    """Return a progress that appends the done steps, after the negative number of all steps."""

    @contextmanager
    def append_steps(description: str, total: int) -> Iterator[Callable[[int], None]]:
        step_counts.append(-total)
        yield step_counts.append

    return append_steps


def fail_without_space(handle: int) -> None:
    """Replace `os.fsync` on a full disk."""
    raise OSError(28, "No space left on device")


def read_files(folder: Path) -> dict[str, bytes]:
    """Return the contents of all files below a folder."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }
