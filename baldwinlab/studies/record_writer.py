"""Storage of finished runs in files of one run or of a batch of runs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby
from pathlib import Path

from baldwinlab.experiment import BaseExperiment
from baldwinlab.simulation.history import History
from baldwinlab.simulation.memory import MAX_BYTES_PER_FILE, MIN_RUNS_PER_BATCH, runs_per_file
from baldwinlab.simulation.records import BatchKeys, encode_history, make_batch
from baldwinlab.studies.checkpoints import remove_checkpoint
from baldwinlab.studies.record_files import (
    assign_runs,
    condition_folder,
    list_record_files,
    record_name,
    split_runs,
)
from baldwinlab.studies.records import record_path, write_in_study


class RecordWriter:
    """Collect the finished runs of a task, and store them when a file is full.

    `is_new`: whether no file holds one of the runs. The folder is not listed then, which takes long
    for many files.
    """

    def __init__(
        self, directory: Path, experiment: BaseExperiment, *, is_new: bool = False
    ) -> None:
        self.directory = directory
        self._condition = experiment.name
        self._runs_per_file = runs_per_file(experiment)
        self._folder = condition_folder(directory, experiment.name)
        self._files = [] if is_new else list_record_files(self._folder)
        self._keys = BatchKeys()
        self._histories: dict[int, History] = {}
        self._runs_with_checkpoints: set[int] = set()

    def add(self, history: History, *, has_checkpoint: bool) -> None:
        """Store a finished run, at once or with later runs."""
        self._histories[history.run] = history
        if has_checkpoint:
            self._runs_with_checkpoints.add(history.run)
        if len(self._histories) >= self._runs_per_file:
            self.flush()

    def flush(self) -> None:
        """Store all finished runs. Raises OSError."""
        if not self._histories:
            return
        first, last = min(self._histories), max(self._histories)
        files = [file for file in self._files if file.first <= last and file.last >= first]
        for runs in split_runs(list(self._histories), assign_runs(files)):
            for histories in self._split(runs):
                self._write(histories)
                for history in histories:
                    del self._histories[history.run]
                    if history.run in self._runs_with_checkpoints:
                        remove_checkpoint(self.directory, self._condition, history.run)

    def _split(self, runs: Sequence[int]) -> Iterator[list[History]]:
        """Yield histories of consecutive runs that one file can hold."""
        histories = [self._histories[run] for run in runs]
        for _, group in groupby(histories, self._keys.key):
            similar = list(group)
            # The number of runs in a file does not consider the arrays of the runs.
            array_bytes = sum(
                array.nbytes
                for arrays in similar[0].stored_run_arrays.values()
                for array in arrays.values()
            )
            n_runs = min(self._runs_per_file, MAX_BYTES_PER_FILE // max(1, array_bytes))
            n_runs = n_runs if min(n_runs, len(similar)) >= MIN_RUNS_PER_BATCH else 1
            for start in range(0, len(similar), n_runs):
                yield similar[start : start + n_runs]

    def _write(self, histories: Sequence[History]) -> None:
        """Write a file of one run or of a batch."""
        first_run, last_run = histories[0].run, histories[-1].run
        if first_run == last_run:
            path = record_path(self.directory, self._condition, first_run)
            write_in_study(self.directory, path, encode_history(histories[0]))
            return
        path = self._folder / record_name(first_run, last_run)
        write_in_study(self.directory, path, make_batch(histories).encode())
