"""Executors of the tasks of a study: threads of this process, Dask clusters and Slurm jobs."""

from __future__ import annotations

import math
import queue
import re
import shutil
import threading
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from pathlib import Path
from typing import Any, Final, NamedTuple, Protocol

from baldwinlab.core.console import warn
from baldwinlab.core.errors import ArgumentError, BaldwinLabError, RefusedError
from baldwinlab.core.files import require_cluster_extra
from baldwinlab.engine.threads import (
    SharedThreads,
    available_cores,
    defer_interruptions,
    share_threads,
    use_threads,
)
from baldwinlab.experiment import BaseExperiment
from baldwinlab.models.miniworld.backends.choice import CPU, Backend
from baldwinlab.studies.store import StudyStore

Done = Callable[[Any, Any], None]
"""Callback that receives a finished task and its result."""
# Seconds until a message explains why a stopped command has not ended.
WAIT_SECONDS: Final = 2.0
# Address of a Dask scheduler.
ADDRESS_PATTERN = re.compile(r"(tcp|tls|ws|wss|ucx)://[^\s/]+:\d+")


class Task(Protocol):
    """Work on a study for one worker. It must be picklable for a worker in another process."""

    @property
    def experiments(self) -> Sequence[BaseExperiment]:
        """Experiments that the task simulates. The worker needs the parts of these experiments."""

    @property
    def agent_steps(self) -> int:
        """Number of agent-steps that the task simulates."""

    def run(
        self, seed: int, directory: Path, backend: Backend, report_progress: Callable[[int], None]
    ) -> Any:
        """Execute the task.

        `report_progress`: called with the number of agent-steps after each generation. If the
        function raises an exception, the task ends.
        """


Work = Callable[[StudyStore, Sequence[Task], int, Backend, Done], Generator[int, None, None]]
"""Implementation of an executor; see `Executor.run`."""


def ignore_result(task: Task, result: Any) -> None:
    """Ignore the result of a task that stores its results."""


class Executor(NamedTuple):
    """Executor of tasks."""

    name: str  # "threads", "dask" or "slurm".
    workers: int  # Number of tasks that are executed in parallel.
    work: Work  # The implementation of `run`.
    # Function that returns the present number of workers while the executor runs, or raises
    # OSError. None if the number of workers does not change.
    count_workers: Callable[[], int] | None = None

    def run(
        self,
        study: StudyStore,
        tasks: Sequence[Task],
        workers: int,
        backend: Backend,
        done: Done = ignore_result,
    ) -> Generator[int, None, None]:
        """Execute the tasks of a study in parallel, and yield each number of finished agent-steps.

        All tasks stop after the current generation if a task or `done` raises an error, or if the
        caller closes the generator (ctrl-C). Unfinished runs are then lost.

        `done`: called in this process with each finished task and its result. The generator raises
        `ExecutorError` if the executor fails. It raises the errors of tasks unchanged.
        """
        return self.work(study, tasks, workers, backend, done)


class ExecutorError(BaldwinLabError):
    """Failure of an executor: no worker can execute the tasks."""


class StoppedError(Exception):
    """Exception that ends a task between two generations."""


def count_threads_per_task(workers: int, tasks: int) -> int:
    """Return the number of threads of each task, above 1 if there are fewer tasks than workers."""
    return max(1, workers // max(1, tasks))


def run_on_threads(
    study: StudyStore, tasks: Sequence[Task], workers: int, backend: Backend, done: Done
) -> Generator[int, None, None]:
    """Execute the tasks on threads of this process. See `Executor.run`.

    If there are fewer tasks than workers, each large world uses several threads. The blocks of
    smaller worlds of all tasks share `workers` threads. While one task is between two lifetimes,
    under the lock of the interpreter, these threads simulate the lifetimes of the other tasks.
    """
    threads_per_task = count_threads_per_task(workers, len(tasks))
    n_parallel = max(1, min(workers, len(tasks)))
    pool_of_ranges = ThreadPoolExecutor(workers)
    # Two ranges for each thread, because the tasks do not have lifetimes all the time.
    shared = SharedThreads(pool_of_ranges, math.ceil(2 * workers / n_parallel))
    stop = threading.Event()
    events: queue.SimpleQueue[int | Future[Any]] = queue.SimpleQueue()

    def report_progress(agent_steps: int) -> None:
        if stop.is_set():
            raise StoppedError
        events.put(agent_steps)

    def run_task(task: Task) -> Any:
        with use_threads(threads_per_task), share_threads(shared if workers > 1 else None):
            return task.run(study.seed, study.directory, backend, report_progress)

    pool = ThreadPoolExecutor(workers)
    unfinished: dict[Future[Any], Task] = {}
    try:
        with defer_interruptions():
            unfinished |= {pool.submit(run_task, task): task for task in tasks}
            for future in unfinished:
                future.add_done_callback(events.put)
        while unfinished:
            # An event is the future of a finished task, or a number of finished agent-steps.
            event = events.get()
            if isinstance(event, Future):
                done(unfinished.pop(event), event.result())
            else:
                yield event
    finally:
        with defer_interruptions():
            stop.set()
            pool.shutdown(wait=False, cancel_futures=True)
        # A user can interrupt only this wait. Tasks end after a lifetime, because `stop` is set.
        running = [future for future in unfinished if not future.cancelled()]
        if wait(running, WAIT_SECONDS).not_done:
            warn(
                "waiting for the end of the present lifetimes; press Ctrl-C again to end without it"
            )
        pool.shutdown()
        pool_of_ranges.shutdown()


THREADS: Final = Executor(name="threads", workers=available_cores(), work=run_on_threads)


def can_share_threads(executor: Executor, backend: Backend) -> bool:
    """Return whether all tasks share the threads of this process for blocks of worlds."""
    return executor.name == THREADS.name and backend.name == CPU.name


def describe_workers(executor: Executor, workers: int, tasks: int) -> str:
    """Return a sentence with the number of threads that execute at least `tasks` tasks.

    For another executor, the sentence has the number of its workers.
    For example: "Workers: 3, each with up to 5 threads; usable cores: 16."
    """
    if executor.name != THREADS.name:
        # A task on a cluster has the runs of complete files, so the number of tasks is unknown.
        return f"Workers: {workers} ({executor.name})."
    threads = count_threads_per_task(workers, tasks)
    threads_text = f", each with up to {threads} threads" if threads > 1 else ""
    return f"Workers: {min(workers, tasks)}{threads_text}; usable cores: {available_cores()}."


def choose_executor(name: str, workers: int | None = None) -> Executor:
    """Return an executor by its name.

    `name`: "threads", "slurm", or the address of a Dask scheduler: "dask:tcp://127.0.0.1:8786".
    `workers`: number of threads, by default the number of cores, or number of Slurm jobs.
    """
    if name == "threads":
        return THREADS if workers is None else THREADS._replace(workers=workers)
    kind, _, address = name.partition(":")
    is_dask = kind == "dask" and ADDRESS_PATTERN.fullmatch(address) is not None
    if name != "slurm" and not is_dask:
        raise ArgumentError("executor", name, "must be threads, dask:tcp://HOST:PORT or slurm")
    require_cluster_extra(f"--executor {name}")
    # Loading Dask takes long, so it is imported only when it is used.
    from baldwinlab.studies.executors import dask

    if name == "slurm":
        if workers is None:
            raise RefusedError("--executor slurm needs --workers: the number of jobs to submit")
        if not shutil.which("sbatch"):
            raise RefusedError(
                "--executor slurm needs sbatch, which is not installed on this machine: "
                "run the command on a machine that submits jobs to Slurm"
            )
        return dask.make_slurm_executor(workers)
    if workers is not None:
        raise ArgumentError(
            "workers",
            workers,
            "is for threads and slurm: a Dask cluster has its own number of workers",
        )
    return dask.make_dask_executor(address)
