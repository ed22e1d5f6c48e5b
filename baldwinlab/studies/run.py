"""Parallel simulation of the missing runs of a study. Each run is stored when it ends."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, closing, contextmanager
from datetime import UTC, datetime
from itertools import groupby
from typing import Final

from baldwinlab.engine.threads import use_threads
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.backends.choice import CPU, Backend
from baldwinlab.simulation.compilation import compile_experiments
from baldwinlab.simulation.memory import count_separate_workers, count_task_runs, runs_per_file
from baldwinlab.studies.checkpoints import (
    EVERY_MINUTE,
    Interval,
    read_stored_lengths,
)
from baldwinlab.studies.executors import (
    THREADS,
    Executor,
    can_share_threads,
    count_threads_per_task,
)
from baldwinlab.studies.progress import ProcessProgress, ProgressFile
from baldwinlab.studies.record_files import RecordFile, assign_runs
from baldwinlab.studies.records import DamagedRecordError, RunLengths
from baldwinlab.studies.run_task import Callback, Observer, RecordWriter, RunTask
from baldwinlab.studies.store import INTERRUPTED, StudyStore

# Maximum number of tasks of a study, unless a worker would have fewer than two tasks.
# See docs/how-to/clusters.md.
MAX_TASKS: Final = 4000
MIN_TASKS_PER_WORKER: Final = 2

Progress = AbstractContextManager[Callable[[int], None]]


def count_agent_steps(experiment: Experiment) -> int:
    """Return the number of agent-steps in one run."""
    return experiment.evolution.generations * experiment.agent_steps


def find_missing_runs(
    study: StudyStore, runs: int, log: Callable[[str], None]
) -> dict[str, list[int]]:
    """Return the numbers of the missing runs of each condition.

    Every stored record is checked. A damaged record is reported and renamed, so its run is missing.
    A run with fewer generations than the study is also missing, unless a stop part ended the run.

    `log`: called with a message for each damaged record.
    """
    requested_runs = range(study.first_run, study.first_run + runs)
    missing: dict[str, list[int]] = {}
    for condition in study.experiments:
        generations = study.experiments[condition].evolution.generations
        complete: set[int] = set()
        lengths_of_files = _read_undamaged_files(study, condition, requested_runs, log)
        for file, file_runs in assign_runs(lengths_of_files):
            n_generations, is_stopped = lengths_of_files[file]
            is_complete = (n_generations == generations) | is_stopped
            complete.update(run for run in file_runs if is_complete[run - file.first])
        missing[condition] = [run for run in requested_runs if run not in complete]
    return missing


def _read_undamaged_files(
    study: StudyStore, condition: str, requested_runs: range, log: Callable[[str], None]
) -> dict[RecordFile, RunLengths]:
    """Rename the damaged files of a condition. Return the run lengths of each undamaged file."""
    lengths = {}
    for file in study.files(condition):
        try:
            lengths[file] = study.lengths(condition, file)
        except DamagedRecordError as error:
            damaged_path = study.rename_damaged(file.path)
            subject, verb = ("its runs", "are") if file.is_batch else (str(file), "is")
            consequence = f"{subject} {verb} not done again, as --runs is {len(requested_runs)}"
            if not {*requested_runs}.isdisjoint(file.runs):
                subject = "its runs" if file.is_batch else "the run"
                consequence = f"{subject} {verb} done again"
            log(f"{error}; it is renamed to {damaged_path.name}, and {consequence}")
    return lengths


def plan_tasks(
    study: StudyStore,
    missing: dict[str, list[int]],
    workers: int,
    worlds: int = CPU.worlds,
    checkpoint_interval: Interval = EVERY_MINUTE,
    callback: Callback | None = None,
    *,
    has_shared_threads: bool = False,
    is_one_process: bool = True,
) -> list[RunTask]:
    """Divide the missing runs into tasks, with the slow tasks (agents that learn) first.

    A task has the number of runs of `count_task_runs`. It has more runs if there would be more than
    `MAX_TASKS` tasks and more than two tasks per worker. The files of records do not depend on the
    tasks: the tasks of one process share a writer, and other tasks have all runs of their files.

    - `worlds`: best number of worlds in a batch of the backend.
    - `callback`: called after each generation of a run, in the thread of its task.
    - `has_shared_threads`: whether all tasks share the threads of one process. Then few large tasks
      use all cores.
    - `is_one_process`: whether this process executes all tasks.
    """
    total_runs = sum(len(runs) for runs in missing.values())
    max_tasks = max(MAX_TASKS, MIN_TASKS_PER_WORKER * workers)
    tasks = []
    for condition, missing_runs in missing.items():
        if not missing_runs:
            continue
        experiment = study.experiments[condition]
        n_workers = count_separate_workers(
            experiment, total_runs, workers, has_shared_threads=has_shared_threads
        )
        n_runs = count_task_runs(experiment, total_runs, n_workers, worlds)
        n_runs *= math.ceil(total_runs / (n_runs * max_tasks))
        groups = _group_by_stored(study, condition, missing_runs)
        for n_generations, runs in groups.items():
            is_new = n_generations == 0
            writer = None
            if is_one_process:
                writer = RecordWriter(study.directory, experiment, runs, is_new=is_new)
            blocks = [[run] for run in runs] if writer else _group_by_file(experiment, runs)
            for task_runs in _join_blocks(blocks, n_runs):
                task = RunTask(
                    experiment=experiment,
                    runs=tuple(task_runs),
                    writer=writer,
                    # The last stored generation is simulated again.
                    n_stored=max(0, n_generations - 1),
                    is_new=is_new,
                    checkpoint_interval=checkpoint_interval,
                    callback=callback,
                )
                tasks.append(task)
    return sorted(tasks, key=lambda task: (not task.experiment.learns, -task.agent_steps))


def _group_by_file(experiment: Experiment, runs: Sequence[int]) -> list[list[int]]:
    """Return the runs in groups that `RecordWriter` stores together."""
    size = runs_per_file(experiment)
    return [list(group) for _, group in groupby(runs, lambda run: run // size)]


def _join_blocks(blocks: Sequence[Sequence[int]], n_runs: int) -> Iterator[list[int]]:
    """Yield the runs of tasks, which have complete blocks and at least about `n_runs` runs each.

    The tasks have about equal numbers of runs, so that they end at about the same time.
    """
    total_runs = sum(map(len, blocks))
    size = math.ceil(total_runs / math.ceil(total_runs / n_runs))
    runs: list[int] = []
    for block in blocks:
        runs.extend(block)
        if len(runs) >= size:
            yield runs
            runs = []
    if runs:
        yield runs


def _group_by_stored(
    study: StudyStore, condition: str, runs: Sequence[int]
) -> dict[int, list[int]]:
    """Return the runs by number of stored generations: {0: [3, 4], 50: [2]}."""
    experiment = study.experiments[condition]
    groups: dict[int, list[int]] = {}
    stored = read_stored_lengths(study.directory, experiment, study.seed, runs)
    for run in runs:
        n_generations = stored[run].n_generations if run in stored else 0
        groups.setdefault(n_generations, []).append(run)
    return groups


def run_study(
    study: StudyStore,
    missing: dict[str, list[int]],
    workers: int,
    progress: Callable[[str, int], Progress],
    log: Callable[[str], None],
    *,
    backend: Backend = CPU,
    executor: Executor = THREADS,
    checkpoint_interval: Interval = EVERY_MINUTE,
    callback: Callback | None = None,
    observe: Observer | None = None,
) -> None:
    """Simulate the missing runs of a study, and store the session.

    - `progress`: `progress(description, total)` returns a context manager. The value of the context
      is a function that is called with each number of finished agent-steps.
    - `callback`: called after each generation of a run, in the thread of its task.
    - `observe`: called with condition, generation, mean fitness and number of runs after each
      generation of a batch.
    """
    study.require_parts()
    study.sweep()
    n_tasks = backend.tasks or workers
    tasks = plan_tasks(
        study,
        missing,
        n_tasks,
        backend.worlds,
        checkpoint_interval,
        callback,
        has_shared_threads=can_share_threads(executor, backend),
        is_one_process=executor.name == THREADS.name,
    )
    tasks = [task._replace(observe=observe) for task in tasks]
    # If several threads simulate a large world, the engine compiles other code for this world.
    with use_threads(count_threads_per_task(workers, len(tasks))):
        compile_seconds = compile_experiments((task.experiment for task in tasks), backend, log)
    log(f"Engine ({backend.name}) ready after {compile_seconds:.1f} s.")
    start_seconds = time.perf_counter()
    start_time = datetime.now(UTC)
    agent_steps_done = 0
    error_of_session = ""
    total_steps = sum(task.agent_steps for task in tasks)
    total_runs = _count_requested_runs(study, missing)
    start = ProcessProgress.begin(
        workers, executor.name, backend.name, runs=total_runs, agent_steps=total_steps
    )
    try:
        with (
            progress("simulating", total_steps) as show_progress,
            _flush_writers(tasks),
            closing(ProgressFile(study.directory, start, executor.count_workers)) as progress_file,
            closing(executor.run(study, tasks, workers, backend)) as increments,
        ):
            for agent_steps in increments:
                agent_steps_done += agent_steps
                show_progress(agent_steps)
                progress_file.add(agent_steps)
    except KeyboardInterrupt:
        error_of_session = INTERRUPTED
        raise
    except BaseException as error:
        error_of_session = str(error) or type(error).__name__
        raise
    finally:
        session = {
            "began": start_time.isoformat(timespec="seconds"),
            "seconds": round(time.perf_counter() - start_seconds, 3),
            "compile_seconds": round(compile_seconds, 3),
            "workers": workers,
            "executor": executor.name,
            "backend": backend.name,
            "runs": total_runs,
        }
        if error_of_session:
            session["error"] = error_of_session
        if agent_steps_done and study.exists():
            # The progress counts the generations after a stop, which were not simulated.
            n_simulated = agent_steps_done - _count_omitted_steps(study, tasks)
            study.add_session(session | {"agent_steps": n_simulated})


@contextmanager
def _flush_writers(tasks: Sequence[RunTask]) -> Iterator[None]:
    """Store the finished runs of interrupted tasks, which share writers, at the end."""
    with ExitStack() as stack:
        for writer in {task.writer for task in tasks if task.writer}:
            stack.callback(writer.flush)
        yield


def _count_requested_runs(study: StudyStore, missing: dict[str, list[int]]) -> int:
    """Return the number of runs of all conditions together after the session."""
    # Every condition has the runs from the first run to the last missing run of all conditions.
    last_run = max((max(runs) for runs in missing.values() if runs), default=study.first_run - 1)
    return (last_run + 1 - study.first_run) * len(study.experiments)


def _count_omitted_steps(study: StudyStore, tasks: Sequence[RunTask]) -> int:
    """Return the number of agent-steps that were not simulated because runs of tasks stopped."""
    n_omitted = 0
    for task in tasks:
        # Few studies have a stop part, so most records are not read.
        if not task.experiment.may_stop:
            continue
        condition = task.experiment.name
        generations = task.experiment.evolution.generations
        task_runs = set(task.runs)
        for file, file_runs in assign_runs(study.files(condition)):
            indices = [run - file.first for run in file_runs if run in task_runs]
            if indices:
                n_generations, is_stopped = study.lengths(condition, file)
                missing = (generations - n_generations)[indices] * is_stopped[indices]
                n_omitted += int(missing.sum()) * task.agent_steps_per_generation
    return n_omitted
