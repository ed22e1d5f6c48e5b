"""Protection of the length of a study, which is the number of generations of its conditions.

A process that simulates a study holds a shared lock on the folder of the study. A process that
extends the study holds the exclusive lock while it writes the new length. So the length never
changes during a simulation. The operating system releases the lock when the process ends or is
killed.

Remote storage and some network file systems have no locks. There, an extension requires that no
other process reports its progress, and each record is written only if the length is unchanged.
"""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from baldwinlab.core.file_writing import try_lock
from baldwinlab.core.files import EXPERIMENT_FILE, is_local, read_text, shorten_path
from baldwinlab.core.records import read_generations
from baldwinlab.experiment import BaseExperiment
from baldwinlab.studies.progress import ProcessProgress, read_progress
from baldwinlab.studies.record_files import StudyError, condition_folder

if TYPE_CHECKING:
    from baldwinlab.studies.store import StudyStore


@contextmanager
def hold_length(study: StudyStore) -> Iterator[None]:
    """Keep other processes from extending a study in this context.

    Raises StudyError if another process extends the study, or has extended it since it was opened.
    """
    with _lock_folder(study.directory, is_exclusive=False) as is_locked:
        if is_locked is False:
            raise StudyError(
                f"another process is extending {study.location}. Nothing was changed. Repeat the "
                "command to use the new number of generations."
            )
        _require_unchanged(study)
        yield


@contextmanager
def change_length(study: StudyStore) -> Iterator[None]:
    """Keep other processes from simulating a study in this context, which extends the study.

    Raises StudyError if another process simulates the study, or has extended it since it was
    opened.
    """
    with _lock_folder(study.directory, is_exclusive=True) as is_locked:
        others = list(_list_other_processes(study.directory))
        if is_locked:
            # No process of this machine simulates the study. A file of a killed process can remain.
            others = [other for other in others if other.host != socket.gethostname()]
        if others or is_locked is False:
            names = [f"the process {other.pid} on {other.host}" for other in others]
            raise StudyError(
                f"{study.location} cannot be extended now, because "
                f"{' and '.join(names) or 'another process'} simulates it. Nothing was changed. "
                "Repeat the command after the end of the simulation."
            )
        _require_unchanged(study)
        yield


def _require_unchanged(study: StudyStore) -> None:
    """Raise StudyError if a condition has another length than when the study was opened."""
    for experiment in study.experiments.values():
        require_same_length(study.directory, experiment)


def _read_stored_generations(directory: Path, condition: str) -> int | None:
    """Return the number of generations in the stored experiment of a condition; None if unknown."""
    path = condition_folder(directory, condition) / "experiment.toml"
    try:
        return read_generations(read_text(path, EXPERIMENT_FILE))
    except (OSError, ValueError):
        return None


def require_same_length(directory: Path, experiment: BaseExperiment) -> None:
    """Raise StudyError if the stored condition has another number of generations."""
    stored = _read_stored_generations(directory, experiment.name)
    if stored not in (None, experiment.evolution.generations):
        raise StudyError(
            f"another process has changed the number of generations of {experiment.name} in "
            f"{shorten_path(directory)} from {experiment.evolution.generations} to {stored}. No "
            "record was changed. Repeat the command to use the new number."
        )


@contextmanager
def _lock_folder(directory: Path, *, is_exclusive: bool) -> Iterator[bool | None]:
    """Yield whether a folder could be locked without waiting; None where locks do not exist."""
    handle = None
    if is_local(directory):
        # A folder cannot be opened on Windows, and may not be readable.
        with suppress(OSError):
            handle = os.open(directory, os.O_RDONLY)
    try:
        yield None if handle is None else try_lock(handle, is_exclusive=is_exclusive)
    finally:
        if handle is not None:
            os.close(handle)


def _list_other_processes(directory: Path) -> Iterator[ProcessProgress]:
    """Yield the progress of the other processes that simulate a study."""
    this_process = (socket.gethostname(), os.getpid())
    for _, progress in read_progress(directory):
        if progress.is_running and (progress.host, progress.pid) != this_process:
            yield progress
