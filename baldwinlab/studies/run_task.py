"""Task that simulates runs of one condition, and stores them in files of one run or of a batch."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from itertools import groupby
from pathlib import Path
from threading import Lock
from typing import Final, NamedTuple

import numpy as np

from baldwinlab.core.deferred import xr
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.models.miniworld.backends.choice import Backend
from baldwinlab.simulation.history import Histories, History
from baldwinlab.simulation.memory import (
    MAX_BYTES_PER_FILE,
    MIN_RUNS_PER_BATCH,
    count_batch_runs,
    runs_per_file,
)
from baldwinlab.simulation.records import BatchKeys, encode_history, make_batch, make_run_dataset
from baldwinlab.simulation.simulate import continue_histories
from baldwinlab.studies.checkpoints import (
    EVERY_MINUTE,
    Checkpointer,
    Interval,
    StoredLength,
    read_longest_record,
    read_stored_lengths,
    remove_checkpoint,
)
from baldwinlab.studies.record_files import (
    RecordFile,
    assign_runs,
    condition_folder,
    list_record_files,
    record_name,
    record_path,
    split_runs,
)
from baldwinlab.studies.records import write_in_study
from baldwinlab.studies.study_length import require_same_length

# Minimum number of agent-steps (about ten seconds) of a task that searches for the runs stored by
# an earlier attempt. A smaller task repeats all runs, which is faster than a list of many files.
MIN_STEPS_OF_SEARCH: Final = 200_000_000
# Called after each generation of a run with the dataset of the run.
Callback = Callable[["xr.Dataset"], None]
# Called after each generation of a batch with condition, generation, mean fitness, number of runs.
Observer = Callable[[str, int, float, int], None]


class RecordWriter:
    """Collect finished runs, and store them when all runs of a block are finished.

    A block is the runs whose numbers have the same quotient by the number of runs in a file. So the
    files depend neither on the tasks that share the writer, nor on the order in which runs finish.
    Nothing is stored if another process has changed the length of the study, so that no stored run
    becomes shorter.

    - `runs`: the runs that the tasks will finish.
    - `is_new`: whether no file holds any of the runs. Then the folder is not listed, because a list
      of many files takes long.
    """

    def __init__(
        self,
        directory: Path,
        experiment: BaseExperiment,
        runs: Iterable[int],
        *,
        is_new: bool = False,
    ) -> None:
        self.directory = directory
        self._experiment = experiment
        self._runs_per_file = runs_per_file(experiment)
        self._folder = condition_folder(directory, experiment.name)
        self._files: list[RecordFile] | None = [] if is_new else None
        self._keys = BatchKeys()
        self._unfinished: dict[int, set[int]] = {}
        for run in runs:
            self._unfinished.setdefault(run // self._runs_per_file, set()).add(run)
        self._histories: dict[int, dict[int, History]] = {}
        self._runs_with_checkpoints: set[int] = set()
        # Tasks on several threads share a writer.
        self._lock = Lock()

    def add(self, history: History, *, has_checkpoint: bool) -> None:
        """Store a finished run, at once or with later runs. Raises OSError."""
        block = history.run // self._runs_per_file
        with self._lock:
            self._histories.setdefault(block, {})[history.run] = history
            if has_checkpoint:
                self._runs_with_checkpoints.add(history.run)
        self.omit([history.run])

    def omit(self, runs: Iterable[int]) -> None:
        """Do not wait for runs that no task will add. Raises OSError."""
        with self._lock:
            for run in runs:
                block = run // self._runs_per_file
                unfinished = self._unfinished.get(block, set())
                unfinished.discard(run)
                if not unfinished:
                    self._store(block)

    def flush(self) -> None:
        """Store all finished runs. Raises OSError."""
        with self._lock:
            for block in self._histories:
                self._store(block)

    def _store(self, block: int) -> None:
        """Store the finished runs of a block."""
        histories = self._histories.get(block, {})
        if not histories:
            return
        if self._files is None:
            self._files = list_record_files(self._folder)
        first, last = min(histories), max(histories)
        files = [file for file in self._files if file.first <= last and file.last >= first]
        # A run whose write fails remains, so that a later call writes it.
        for runs in list(split_runs(list(histories), assign_runs(files))):
            for group in list(self._split([histories[run] for run in runs])):
                self._write(group)
                for history in group:
                    del histories[history.run]
                    if history.run in self._runs_with_checkpoints:
                        remove_checkpoint(self.directory, self._experiment.name, history.run)

    def _split(self, histories: Sequence[History]) -> Iterator[list[History]]:
        """Divide histories of consecutive runs into groups that one file can hold."""
        for _, group in groupby(histories, self._keys.key):
            similar = list(group)
            # `runs_per_file` does not count the bytes of the run arrays of parts.
            array_bytes = sum(
                array.nbytes
                for arrays in similar[0].stored_run_arrays.values()
                for array in arrays.values()
            )
            n_runs = min(self._runs_per_file, MAX_BYTES_PER_FILE // max(1, array_bytes))
            # A batch of a few runs saves no time, so each of these runs gets a file.
            n_runs = n_runs if min(n_runs, len(similar)) >= MIN_RUNS_PER_BATCH else 1
            for start in range(0, len(similar), n_runs):
                yield similar[start : start + n_runs]

    def _write(self, histories: Sequence[History]) -> None:
        """Write a file of one run or of a batch."""
        require_same_length(self.directory, self._experiment)
        first_run, last_run = histories[0].run, histories[-1].run
        if first_run == last_run:
            path = record_path(self.directory, self._experiment.name, first_run)
            write_in_study(self.directory, path, encode_history(histories[0]))
            return
        path = self._folder / record_name(first_run, last_run)
        write_in_study(self.directory, path, make_batch(histories).encode())


class RunTask(NamedTuple):
    """Task that simulates runs of one condition and stores each run when it ends."""

    experiment: Experiment
    runs: tuple[int, ...]
    n_stored: int = 0  # Number of generations of each run that are not simulated again.
    is_new: bool = False  # Whether no file holds any of the runs.
    checkpoint_interval: Interval = EVERY_MINUTE
    callback: Callback | None = None
    observe: Observer | None = None
    # The writer that tasks in one process share. By default a task has its own writer.
    writer: RecordWriter | None = None

    @property
    def experiments(self) -> tuple[Experiment, ...]:
        return (self.experiment,)

    @property
    def agent_steps(self) -> int:
        return len(self.runs) * self._agent_steps_per_run

    @property
    def _agent_steps_per_run(self) -> int:
        missing_generations = self.experiment.evolution.generations - self.n_stored
        return missing_generations * self.agent_steps_per_generation

    @property
    def agent_steps_per_generation(self) -> int:
        """Number of agent-steps in one generation of one run."""
        return self.experiment.agent_steps

    def run(
        self, seed: int, directory: Path, backend: Backend, report_progress: Callable[[int], None]
    ) -> None:
        """Simulate the runs in batches. See `Task`."""
        batch_size = count_batch_runs(self.experiment, backend.worlds)
        stored = self._find_stored(seed, directory)
        runs = [run for run in self.runs if not self._is_complete(stored.get(run))]
        if n_complete := len(self.runs) - len(runs):
            report_progress(n_complete * self._agent_steps_per_run)
        writer = self.writer or RecordWriter(
            directory, self.experiment, self.runs, is_new=self.is_new and not stored
        )
        writer.omit(set(self.runs).difference(runs))
        simulate = partial(self._simulate_batch, seed, backend, writer, report_progress)
        try:
            for start in range(0, len(runs), batch_size):
                batch = runs[start : start + batch_size]
                simulate({run: stored.get(run) for run in batch})
        finally:
            # The runs of an interrupted task. A shared writer also waits for other tasks.
            if writer is not self.writer:
                writer.flush()

    def _find_stored(self, seed: int, directory: Path) -> dict[int, StoredLength]:
        """Return the lengths of the runs that another attempt or process has stored, by run."""
        has_checkpoints = self.checkpoint_interval.generations > 0
        if self.agent_steps < MIN_STEPS_OF_SEARCH and not has_checkpoints:
            return {}
        return read_stored_lengths(directory, self.experiment, seed, self.runs)

    def _is_complete(self, stored: StoredLength | None) -> bool:
        if stored is None:
            return False
        return stored.is_stopped or stored.n_generations == self.experiment.evolution.generations

    def _simulate_batch(
        self,
        seed: int,
        backend: Backend,
        writer: RecordWriter,
        report_progress: Callable[[int], None],
        runs: Mapping[int, StoredLength | None],
    ) -> None:
        directory = writer.directory
        checkpointer = Checkpointer(directory, self.checkpoint_interval)

        def after_generation(histories: Sequence[History]) -> None:
            batch = histories[0].batch
            # The other runs stopped in an earlier generation, and `writer` has them already.
            indices = np.flatnonzero(batch.generation_counts == batch.n_generations)
            simulated = [histories[index] for index in indices.tolist()]
            checkpointer.save(simulated)
            if self.callback:
                for history in simulated:
                    # The dataset shares its arrays with the history, which changes later.
                    self.callback(make_run_dataset(history).copy(deep=True))
            generation = batch.n_generations - 1
            if self.observe:
                fitness = float(batch.fitness[indices, generation].mean())
                self.observe(self.experiment.name, generation, fitness, len(indices))
            n_missing = self.experiment.evolution.generations - batch.n_generations
            is_stopped = batch.is_stopped[indices]
            for index in indices[is_stopped | (n_missing == 0)].tolist():
                is_continued = not self.is_new or runs[histories[index].run] is not None
                has_checkpoint = is_continued or checkpointer.has_saved
                writer.add(histories[index], has_checkpoint=has_checkpoint)
            # Generations after a stop count as done, so that the progress reaches its total.
            n_done = len(simulated) + int(is_stopped.sum()) * n_missing
            report_progress(n_done * self.agent_steps_per_generation)

        for batch in self._begin_batches(seed, directory, runs):
            if n_found := (batch.n_generations - self.n_stored) * len(batch.runs):
                report_progress(n_found * self.agent_steps_per_generation)
            continue_histories(batch, backend, after_generation)

    def _begin_batches(
        self, seed: int, directory: Path, runs: Mapping[int, StoredLength | None]
    ) -> Iterator[Histories]:
        """Yield the histories of runs with the same number of stored generations."""
        new_runs: list[int] = []
        records: dict[int, dict[int, xr.Dataset]] = {}
        for run, stored in runs.items():
            record = None
            if self.n_stored or stored:
                record = read_longest_record(directory, self.experiment, seed, run)
            if record is None:
                new_runs.append(run)
            else:
                records.setdefault(record.sizes["generation"], {})[run] = record
        if new_runs:
            yield Histories(self.experiment, seed, new_runs)
        while records:
            # No variable refers to the records during the simulation, because they can be large.
            yield self._restore(seed, records.popitem()[1])

    def _restore(self, seed: int, records: Mapping[int, xr.Dataset]) -> Histories:
        """Return the histories of runs that begin with `records`, by run."""
        return Histories(self.experiment, seed, [*records], [*records.values()])
