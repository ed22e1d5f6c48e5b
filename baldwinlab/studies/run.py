"""Many runs: several at a time, each stored as it ends; what is stored already is not run again."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import AbstractContextManager, closing
from datetime import UTC, datetime
from pathlib import Path
from typing import Final, NamedTuple

from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.backends.choice import CPU, Backend
from baldwinlab.simulation.compilation import compile_experiments
from baldwinlab.simulation.simulate import simulate_histories
from baldwinlab.studies.executors import THREADS, Executor, available_cores
from baldwinlab.studies.records import DamagedRecordError, write_record
from baldwinlab.studies.store import StudyStore

__all__ = [
    "RunTask",
    "available_cores",
    "count_agent_steps",
    "find_missing_runs",
    "plan_tasks",
    "run_study",
]

# Enough for 10,000 cores, and few enough for a Dask scheduler: docs/explanation/distributed-execution.md
MAX_TASKS: Final = 20_000

Progress = AbstractContextManager[Callable[[int], None]]


class RunTask(NamedTuple):
    """A task: runs of one condition, each stored as its batch ends."""

    experiment: Experiment
    runs: tuple[int, ...]

    @property
    def experiments(self) -> tuple[Experiment, ...]:
        return (self.experiment,)

    @property
    def agent_steps(self) -> int:
        return len(self.runs) * count_agent_steps(self.experiment)

    def run(
        self, seed: int, directory: Path, backend: Backend, lived: Callable[[int], None]
    ) -> None:
        """In batches of as many worlds as suit the backend. See `Task`."""
        for first in range(0, len(self.runs), backend.worlds):
            self._replace(runs=self.runs[first : first + backend.worlds])._do_batch(
                seed, directory, backend, lived
            )

    def _do_batch(
        self, seed: int, directory: Path, backend: Backend, lived: Callable[[int], None]
    ) -> None:
        share = self.agent_steps // self.experiment.evolution.generations
        for history in simulate_histories(
            self.experiment, seed, self.runs, backend, lambda histories: lived(share)
        ):
            write_record(directory, self.experiment.name, history.run, history.record())


def count_agent_steps(experiment: Experiment) -> int:
    return experiment.evolution.generations * experiment.steps * experiment.population.size


def find_missing_runs(
    study: StudyStore, runs: int, tell: Callable[[str], None]
) -> dict[str, list[int]]:
    """Return the runs that are still to do, by condition.

    Every stored record is checked. A damaged one is named and set aside, so that it is one of them,
    unless its number is not below `runs`.
    """
    missing: dict[str, list[int]] = {}
    for condition in study.experiments:
        stored = set(study.runs(condition))
        for run in sorted(stored):
            try:
                study.record(condition, run)
            except DamagedRecordError as error:
                aside = study.set_aside(condition, run)
                what = (
                    "the run is done again"
                    if run < runs
                    else f"run {run} is not done again, as --runs is {runs}"
                )
                tell(f"{error}; it is kept as {aside.name} and {what}")
                stored.discard(run)
        missing[condition] = [run for run in range(runs) if run not in stored]
    return missing


def plan_tasks(
    study: StudyStore, missing: dict[str, list[int]], workers: int, worlds: int = CPU.worlds
) -> list[RunTask]:
    """Runs in tasks, the slow ones (those that learn) first, so that no worker is left with one at the end.

    A task is a batch of as many worlds as suit the backend; several, where there would be more than `MAX_TASKS`; or fewer
    worlds, where some workers would have nothing to do.
    """
    total = sum(len(runs) for runs in missing.values())
    batches = -(-total // (worlds * MAX_TASKS))
    size = max(1, min(worlds * batches, total // workers))
    tasks = [
        RunTask(study.experiments[condition], tuple(runs[first : first + size]))
        for condition, runs in missing.items()
        for first in range(0, len(runs), size)
    ]
    return sorted(tasks, key=lambda task: (not task.experiment.learns, -task.agent_steps))


def run_study(
    study: StudyStore,
    missing: dict[str, list[int]],
    workers: int,
    progress: Callable[[str, int], Progress],
    tell: Callable[[str], None],
    backend: Backend = CPU,
    executor: Executor = THREADS,
) -> None:
    """Do the missing runs of a study, so many tasks at a time, and note how long that took.

    `progress(description, total)` opens what is called with the agent-steps that have been done.
    """
    study.require_parts()
    study.sweep()
    tasks = plan_tasks(study, missing, workers, backend.worlds)
    compile_seconds = compile_experiments((task.experiment for task in tasks), backend, tell)
    tell(f"Engine ({backend.name}) ready after {compile_seconds:.1f} s.")
    start, began, done = time.perf_counter(), datetime.now(UTC), 0
    try:
        with (
            progress("simulating", sum(task.agent_steps for task in tasks)) as show,
            closing(executor.run(study, tasks, workers, backend)) as amounts,
        ):
            for amount in amounts:
                done += amount
                show(amount)
    finally:
        session = {
            "began": began.isoformat(timespec="seconds"),
            "seconds": round(time.perf_counter() - start, 3),
            "compile_seconds": round(compile_seconds, 3),
            "workers": workers,
            "executor": executor.name,
            "backend": backend.name,
            "agent_steps": done,
        }
        if done and study.exists():
            study.add_session(session)
