"""Checkpoints: the finished generations of a run that is not complete.

A checkpoint has the format of a record, and is stored in runs/CONDITION/RUN.checkpoint. A killed
run continues from its checkpoint: the last stored generation is simulated again, and then the next
generations. A run continues in the same way from its record after an extension of the study.
"""

from __future__ import annotations

import re
import time
from collections.abc import Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Final, NamedTuple, Self

from baldwinlab.core.deferred import xr
from baldwinlab.core.errors import ArgumentError
from baldwinlab.core.file_writing import remove_file
from baldwinlab.core.files import list_names
from baldwinlab.experiment import BaseExperiment
from baldwinlab.simulation.history import History
from baldwinlab.simulation.records import encode_history
from baldwinlab.studies.record_files import (
    assign_runs,
    condition_folder,
    list_record_files,
    record_path,
)
from baldwinlab.studies.records import (
    StudyError,
    read_lengths,
    read_record,
    read_record_file,
    write_in_study,
)

CHECKPOINT_SUFFIX: Final = ".checkpoint"
INTERVAL_PATTERN: Final = re.compile(r"([1-9][0-9]{0,8})(s?)")


class Interval(NamedTuple):
    """Interval between two checkpoints of a run: a number of generations, or seconds."""

    generations: int = 0  # Number of generations, 0 if the interval is a duration.
    seconds: float = 0  # Duration in seconds, 0 if the interval is a number of generations.

    @classmethod
    def parse(cls, text: str) -> Self:
        """Return the interval of a text such as "60s" or "100" (generations)."""
        match = INTERVAL_PATTERN.fullmatch(str(text))
        if match is None:
            raise ArgumentError(
                "checkpoint", text, "must be a number of generations or of seconds: 100 or 60s"
            )
        number = int(match[1])
        is_duration = match[2] == "s"
        return cls(seconds=number) if is_duration else cls(generations=number)


EVERY_MINUTE: Final = Interval(seconds=60)


class Checkpointer:
    """Write a checkpoint of each run of a batch after every interval.

    `has_saved`: whether a checkpoint has been written.
    """

    def __init__(self, directory: Path, interval: Interval) -> None:
        self._directory = directory
        self._interval = interval
        self._written_at = time.monotonic()
        self.has_saved = False

    def save(self, histories: Sequence[History]) -> None:
        """Write the checkpoints of incomplete runs, if the interval has passed."""
        # All runs have the same number of generations.
        if not self._is_due(histories[0].n_generations):
            return
        incomplete = [history for history in histories if not history.is_complete]
        if not incomplete:
            return
        for history in incomplete:
            path = checkpoint_path(self._directory, history.experiment.name, history.run)
            write_in_study(self._directory, path, encode_history(history))
        self._written_at = time.monotonic()
        self.has_saved = True

    def _is_due(self, n_generations: int) -> bool:
        if self._interval.generations:
            return n_generations % self._interval.generations == 0
        elapsed_seconds = time.monotonic() - self._written_at
        return elapsed_seconds >= self._interval.seconds


def checkpoint_path(directory: Path, condition: str, run: int) -> Path:
    """Return the file of the checkpoint of a run."""
    return record_path(directory, condition, run).with_suffix(CHECKPOINT_SUFFIX)


def remove_checkpoint(directory: Path, condition: str, run: int) -> None:
    """Remove the checkpoint of a run, if there is one."""
    remove_file(checkpoint_path(directory, condition, run))


class StoredLength(NamedTuple):
    """Length of a run that has a checkpoint or a record."""

    n_generations: int
    is_stopped: bool  # Whether the stop part has ended the run.


def read_stored_lengths(
    directory: Path, experiment: BaseExperiment, seed: int, runs: Iterable[int]
) -> dict[int, StoredLength]:
    """Return the lengths of the runs that have a checkpoint or a record.

    The parameters are those of `read_longest_record`. A damaged file counts as missing.
    """
    requested_runs = set(runs)
    folder = condition_folder(directory, experiment.name)
    stored: dict[int, StoredLength] = {}
    for file, file_runs in assign_runs(list_record_files(folder)):
        if requested_runs.isdisjoint(file_runs):
            continue
        with suppress(StudyError):
            counts, is_stopped = read_lengths(file, experiment, seed)
            for run in requested_runs.intersection(file_runs):
                index = run - file.first
                stored[run] = StoredLength(int(counts[index]), bool(is_stopped[index]))
    file_names = list_names(folder) if folder.is_dir() else {}
    for run in requested_runs:
        path = checkpoint_path(directory, experiment.name, run)
        if path.name in file_names:
            with suppress(StudyError):
                record = read_record_file(path, experiment, seed, run)
                # `max` selects the longer run. Of equally long runs, it selects a stopped run.
                checkpoint = StoredLength(record.sizes["generation"], is_stopped=False)
                stored[run] = max(checkpoint, stored.get(run, checkpoint))
    return stored


def read_longest_record(
    directory: Path, experiment: BaseExperiment, seed: int, run: int
) -> xr.Dataset | None:
    """Return the checkpoint or the record of a run: the one with more generations.

    A damaged file counts as missing, because the run can be simulated again. Without a file, the
    result is None.
    """
    path = checkpoint_path(directory, experiment.name, run)
    records = []
    with suppress(StudyError):
        records.append(read_record_file(path, experiment, seed, run))
    with suppress(StudyError):
        records.append(read_record(directory, experiment, seed, run))
    return max(records, key=lambda record: record.sizes["generation"], default=None)
