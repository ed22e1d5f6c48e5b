"""Many runs: several at a time on threads, each stored as it ends; what is stored already is not run again."""

from __future__ import annotations

import os
import queue
import threading
import time
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import AbstractContextManager, closing
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from baldwinlab.config import Experiment
from baldwinlab.engine.backend import CPU, Backend
from baldwinlab.simulate import simulate_block
from baldwinlab.store import DamagedRecordError, Study
from baldwinlab.toml import to_toml
from baldwinlab.variables import PARENTS, RUN

WORLDS_PER_BLOCK = CPU.worlds

Progress = AbstractContextManager[Callable[[int], None]]


class Task(NamedTuple):
    """Runs of one condition that live side by side."""

    experiment: Experiment
    runs: tuple[int, ...]

    @property
    def agent_steps(self) -> int:
        return len(self.runs) * agent_steps_of_run(self.experiment)


class StoppedError(Exception):
    """Raised in a worker to end it between two generations."""


def agent_steps_of_run(experiment: Experiment) -> int:
    return experiment.evolution.generations * experiment.lifetime.steps * experiment.population.size


def available_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def missing_runs(study: Study, runs: int, tell: Callable[[str], None]) -> dict[str, list[int]]:
    """The runs that are still to do, by condition. A damaged record is named and set aside, so it is one of them."""
    missing: dict[str, list[int]] = {}
    for condition in study.experiments:
        stored = set(study.runs(condition))
        for run in sorted(stored & set(range(runs))):
            try:
                study.read(condition, run)
            except DamagedRecordError as error:
                aside = study.set_aside(condition, run)
                tell(f"{error}; it is kept as {aside.name} and the run is done again")
                stored.discard(run)
        missing[condition] = [run for run in range(runs) if run not in stored]
    return missing


def plan(study: Study, missing: dict[str, list[int]], workers: int, worlds: int = CPU.worlds) -> list[Task]:
    """Blocks of runs, the slow ones (those that learn) first, so that no worker is left with one at the end."""
    total = sum(len(runs) for runs in missing.values())
    size = max(1, min(worlds, total // workers))
    tasks = [
        Task(study.experiments[condition], tuple(runs[first : first + size]))
        for condition, runs in missing.items()
        for first in range(0, len(runs), size)
    ]
    return sorted(tasks, key=lambda task: (not task.experiment.learns, -task.agent_steps))


def run_tasks(study: Study, tasks: Sequence[Task], workers: int, backend: Backend = CPU) -> Generator[int, None, None]:
    """Do the tasks on threads, storing each run as it ends; yield the agent-steps done, a generation at a time.

    When a task raises, or the caller stops asking (ctrl-C), the others end at their next generation, what they had in flight
    is dropped, and the error is raised.
    """
    stop = threading.Event()
    news: queue.SimpleQueue[int | Future[None]] = queue.SimpleQueue()

    def do(task: Task) -> None:
        share = task.agent_steps // task.experiment.evolution.generations

        def after_generation(generation: int) -> None:
            if stop.is_set():
                raise StoppedError
            news.put(share)

        records = simulate_block(task.experiment, study.seed, task.runs, backend, after_generation)
        for run, record in zip(task.runs, records, strict=True):
            study.write(task.experiment.name, run, record)

    with ThreadPoolExecutor(workers) as pool:
        left = len(tasks)
        for task in tasks:
            pool.submit(do, task).add_done_callback(news.put)
        try:
            while left:
                item = news.get()
                if isinstance(item, Future):
                    item.result()
                    left -= 1
                else:
                    yield item
        finally:
            stop.set()
            pool.shutdown(wait=True, cancel_futures=True)


def run_study(
    study: Study,
    missing: dict[str, list[int]],
    workers: int,
    progress: Callable[[str, int], Progress],
    tell: Callable[[str], None],
    backend: Backend = CPU,
) -> None:
    """Do the missing runs of a study, and note how long that took.

    `progress(description, total)` opens what is called with the agent-steps that have been done.
    """
    study.sweep()
    tasks = plan(study, missing, workers, backend.worlds)
    compile_seconds = backend.warm_up(task.experiment for task in tasks)
    tell(f"the engine ({backend.name}) is ready: {compile_seconds:.1f} s to compile it, or to load it as it was compiled before")
    start, began, done = time.perf_counter(), datetime.now(UTC), 0
    try:
        with (
            progress("living", sum(task.agent_steps for task in tasks)) as show,
            closing(run_tasks(study, tasks, workers, backend)) as amounts,
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
            "backend": backend.name,
            "agent_steps": done,
        }
        if done:
            study.add_session(session)


def open_study(directory: str | Path, conditions: Sequence[str] | None = None) -> xr.Dataset:
    """All stored runs of a study, without the genomes, as one dataset with dims (condition, run, generation, agent).

    `conditions` picks some of the study's. Where they have different numbers of runs, generations or agents, the gaps are NaN.
    `experiment(condition)` is each condition as TOML. Raises StudyError for a condition that the study has not, and (as
    DamagedRecordError) for a record that is not what was written.
    """
    study = Study(Path(directory))
    return open_conditions(study, list(study.experiments if conditions is None else conditions))


def open_conditions(study: Study, names: Sequence[str]) -> xr.Dataset:
    """As `open_study`, of a study that is open already: of thousands of conditions, opening it takes seconds."""
    texts = [to_toml(study.experiment(name)) for name in names]
    opened = [_open_condition(study, name) for name in names]
    found = xr.concat(opened, "condition", join="outer", data_vars="all", coords="minimal", combine_attrs="drop")
    found = found.assign_coords(condition=list(names))
    return found.assign(experiment=("condition", texts)).assign_attrs(seed=study.seed)


def _open_condition(study: Study, condition: str) -> xr.Dataset:
    numbers = study.runs(condition)
    if not numbers:
        return _no_runs(study.experiments[condition])
    records = [study.read(condition, run).drop_vars(["genome", "module", "weight"]) for run in numbers]
    return xr.concat(records, "run", combine_attrs="drop").assign_coords(run=np.array(numbers, np.int32))


def _no_runs(experiment: Experiment) -> xr.Dataset:
    sizes = {
        "run": 0,
        "generation": experiment.evolution.generations,
        "agent": experiment.population.size,
        "parent": len(PARENTS),
    }
    arrays = {name: ("run", *RUN[name].dims) for name in ("food_eaten", "energy", "parents")}
    empty = {name: (dims, np.empty([sizes[dim] for dim in dims], RUN[name].dtype)) for name, dims in arrays.items()}
    coords = {dim: np.arange(size, dtype=np.int32) for dim, size in sizes.items() if dim != "parent"}
    return xr.Dataset(empty, coords | {"parent": list(PARENTS)})
