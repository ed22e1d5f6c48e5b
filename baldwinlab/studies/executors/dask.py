"""Executors on a Dask cluster, and the execution of a task on its workers.

The cluster exists already, or the workers are Slurm jobs. A task is sent as plain data with the
sources of third-party parts. The worker writes records into the study itself, so only the other
results of a task pass through the scheduler.

Tasks are submitted in waves, so the number of tasks in the scheduler does not grow with the study.
Workers report progress by events of the scheduler. The total rate of events is limited.
"""

from __future__ import annotations

import pickle
import queue
import subprocess
import time
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import AbstractContextManager, contextmanager
from functools import partial
from pathlib import Path
from threading import Lock
from typing import Any, Final, NamedTuple
from uuid import uuid4

import dask.config
from distributed import Client, Future, KilledWorker, Worker, get_worker

from baldwinlab.core.errors import PartError, RefusedError
from baldwinlab.core.files import is_local, is_study, parse_location
from baldwinlab.engine.cache import engine_hash
from baldwinlab.models.miniworld.backends.choice import Backend, choose_backend
from baldwinlab.parts.loading import Source, load_text, sources_of
from baldwinlab.studies.executors import Done, Executor, ExecutorError, StoppedError, Task
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore

# Timeout of a connection to a scheduler, in seconds.
CONNECTION_TIMEOUT: Final = 10
# Maximum rate of progress events of all tasks.
EVENTS_PER_SECOND: Final = 100
# Maximum number of unfinished tasks in the scheduler, or two per core if this is more.
TASKS_PER_WAVE: Final = 1000
TASKS_PER_CORE: Final = 2
# Minimum time between two events of a task, in seconds.
MIN_EVENT_INTERVAL: Final = 2.0
LOST_SCHEDULER: Final = "the connection to the Dask scheduler is lost"

# Hash of the sources of the engine and the version of Numba.
ENGINE_HASH: Final = engine_hash()
# All threads of a worker share the registry of parts, so only one thread loads parts at a time.
LOADING_LOCK: Final = Lock()


class DaskCluster:
    """A Dask cluster that executes the tasks of a study."""

    def __init__(self, connect: Callable[[], AbstractContextManager[Client]]) -> None:
        self._connect = connect
        self._client: Client | None = None

    def count_cores(self) -> int:
        """Return the number of cores that the cluster has now, 0 outside of `run`.

        Raises OSError if the scheduler does not answer.
        """
        return sum(self._client.nthreads().values()) if self._client else 0

    def run(
        self,
        study: StudyStore,
        tasks: Sequence[Task],
        workers: int,
        backend: Backend,
        done: Done,
    ) -> Generator[int, None, None]:
        """Execute the tasks on the workers of the cluster. See `Executor.run`."""
        with self._connect() as client:
            self._client = client
            try:
                yield from Submission(client, study, backend, tasks).run(done)
            finally:
                self._client = None


def make_dask_executor(address: str) -> Executor:
    """Return the executor on an existing cluster. Raises RefusedError if no scheduler answers."""
    cluster = DaskCluster(partial(_connect, address))
    with _connect(address) as client:
        # An adaptive cluster starts its workers later, when it has tasks.
        n_cores = max(1, sum(client.nthreads().values()))
    return Executor("dask", n_cores, cluster.run, cluster.count_cores)


def make_slurm_executor(jobs: int) -> Executor:
    """Return the executor on Slurm jobs, which Dask's configuration describes.

    Raises RefusedError if the configuration does not describe a job.
    """
    cluster = DaskCluster(partial(_start_slurm_jobs, jobs))
    return Executor("slurm", jobs * _count_job_cores(), cluster.run, cluster.count_cores)


def _connect(address: str) -> Client:
    try:
        return Client(address, timeout=CONNECTION_TIMEOUT, set_as_default=False)
    except (OSError, ValueError, RuntimeError):
        raise RefusedError(
            f"no Dask scheduler answers at {address}; start one with `dask scheduler`"
        ) from None


@contextmanager
def _start_slurm_jobs(jobs: int) -> Iterator[Client]:
    # Workers load this module for their tasks, and need no library that submits jobs.
    from dask_jobqueue import SLURMCluster

    with SLURMCluster() as cluster, Client(cluster, set_as_default=False) as client:
        _require_job(cluster.job_script())
        # Unlike `scale`, `adapt` replaces a job that ends early.
        cluster.adapt(minimum_jobs=jobs, maximum_jobs=jobs)
        yield client


def _require_job(script: str) -> None:
    """Raise ExecutorError if Slurm rejects the job; Dask would wait for it without a message."""
    test = subprocess.run(["sbatch", "--test-only"], input=script, capture_output=True, text=True)
    if test.returncode != 0:
        lines = (test.stderr.strip() or test.stdout.strip()).splitlines()
        reason = lines[-1] if lines else f"sbatch ended with status {test.returncode}"
        raise ExecutorError(f"Slurm refuses the job: {reason}")


def _count_job_cores() -> int:
    job = {name: dask.config.get(f"jobqueue.slurm.{name}", None) for name in ("cores", "memory")}
    missing = [name for name, value in job.items() if value is None]
    if missing:
        names = " and ".join(f"jobqueue.slurm.{name}" for name in missing)
        raise RefusedError(
            f"--executor slurm needs {names} in Dask's configuration: the resources of a job, "
            "see docs/how-to/clusters.md"
        )
    return int(job["cores"])


class Submission:
    """Tasks that are submitted to a cluster in waves.

    Workers report the remaining agent-steps of a task. At the end of a task, the agent-steps that
    were not reported are added. A task of a lost worker starts again. The agent-steps of this task
    are counted only after the second attempt has passed the progress of the first attempt.
    """

    def __init__(
        self, client: Client, study: StudyStore, backend: Backend, tasks: Sequence[Task]
    ) -> None:
        directory = study.directory.absolute() if is_local(study.directory) else study.directory
        sources = sources_of(experiment for task in tasks for experiment in task.experiments)
        self._client = client
        self._topic = f"baldwinlab-{uuid4().hex}"
        # `pack_task` replaces the task and the interval.
        self._message = RemoteTask(
            task=b"",
            parts=tuple((source, source.sha256) for source in sources),
            seed=study.seed,
            directory=str(directory),
            backend=backend.name,
            engine=ENGINE_HASH,
            topic=self._topic,
            event_interval=MIN_EVENT_INTERVAL,
        )
        self._waiting = deque((f"{self._topic}-{i}", task) for i, task in enumerate(tasks))
        self._wave_size = TASKS_PER_WAVE
        self._tasks: dict[str, Task] = {}
        self._remaining: dict[str, int] = {}
        self._futures: dict[str, Future] = {}
        self._events: queue.SimpleQueue[Future | tuple[str, int]] = queue.SimpleQueue()

    def run(self, done: Done) -> Generator[int, None, None]:
        """Submit the tasks, and yield the agent-steps done. See `Executor.run`."""
        self._client.subscribe_topic(self._topic, self._queue_progress)
        self._submit_wave()
        try:
            while self._futures:
                event = self._events.get()
                if isinstance(event, Future):
                    key, remaining_steps = event.key, 0
                    done(self._tasks.pop(key), _get_result(event))
                    # The scheduler releases a task when the last reference to its future is gone.
                    del self._futures[key]
                    self._submit_wave()
                else:
                    key, remaining_steps = event
                # An event can arrive after the end of its task.
                agent_steps = self._remaining.get(key, 0) - remaining_steps
                if agent_steps > 0:
                    yield agent_steps
                    self._remaining[key] = remaining_steps
                if key not in self._futures:
                    self._remaining.pop(key, None)
        finally:
            self._client.cancel(list(self._futures.values()))

    def _queue_progress(self, event: tuple[Any, tuple[str, int]]) -> None:
        _, progress = event
        self._events.put(progress)

    def _submit_wave(self) -> None:
        """Submit tasks if at most half of a wave is unfinished."""
        if not self._waiting or len(self._futures) > self._wave_size // 2:
            return
        try:
            n_cores = sum(self._client.nthreads().values())
        except OSError:
            raise ExecutorError(LOST_SCHEDULER) from None
        self._wave_size = max(TASKS_PER_WAVE, TASKS_PER_CORE * n_cores)
        n_tasks = min(len(self._waiting), self._wave_size - len(self._futures))
        wave = dict(self._waiting.popleft() for _ in range(n_tasks))
        messages = [self.pack_task(task, n_cores) for task in wave.values()]
        futures = self._client.map(
            run_remote_task, messages, key=list(wave), pure=False, batch_size=TASKS_PER_WAVE
        )
        self._tasks |= wave
        self._remaining |= {key: task.agent_steps for key, task in wave.items()}
        self._futures |= {future.key: future for future in futures}
        for future in futures:
            future.add_done_callback(self._events.put)

    def pack_task(self, task: Task, n_cores: int) -> bytes:
        """Return the message of a task for a cluster with `n_cores`."""
        interval = max(MIN_EVENT_INTERVAL, n_cores / EVENTS_PER_SECOND)
        message = self._message._replace(task=pickle.dumps(task), event_interval=interval)
        return pickle.dumps(message)


def _get_result(future: Future) -> Any:
    """Return the result of a task.

    Raises the error of the task, and ExecutorError if the cluster has lost the task.
    """
    try:
        return future.result()
    except CancelledError:
        raise ExecutorError(LOST_SCHEDULER) from None
    except KilledWorker as error:
        attempts = error.allowed_failures + 1
        raise ExecutorError(f"a task failed: it has ended {attempts} workers in turn") from None


class RemoteTask(NamedTuple):
    """Message to a worker. It is sent as pickled bytes, because Dask does not inspect bytes."""

    task: bytes  # The pickled task. A worker can unpickle it only after it has loaded the parts.
    parts: tuple[tuple[Source, str], ...]  # Sources of third-party parts, each with its SHA-256.
    seed: int
    directory: str
    backend: str
    engine: str  # Hash of the engine. The engine of the worker must have the same hash.
    topic: str  # Topic of the progress events.
    event_interval: float  # Minimum time between two events of this task, in seconds.


def run_remote_task(message: bytes) -> Any:
    """Execute a task on a worker."""
    remote_task: RemoteTask = pickle.loads(message)
    worker = get_worker()
    if remote_task.engine != ENGINE_HASH:
        raise StudyError(
            f"the worker {worker.address} has another version of baldwinlab or Numba "
            "than this process; install the same versions on all machines"
        )
    directory = parse_location(remote_task.directory)
    if not is_study(directory):
        raise StudyError(
            f"the worker {worker.address} cannot access {directory}: "
            "put the study where all workers can access it"
        )
    with LOADING_LOCK:
        _register_parts(remote_task.parts)
        task: Task = pickle.loads(remote_task.task)
    report_progress = _progress_reporter(
        worker, task.agent_steps, remote_task.topic, remote_task.event_interval
    )
    # With another scheduler, xarray opens a Dask client in every worker when xarray writes a file.
    with dask.config.set(scheduler="synchronous"):
        return task.run(
            remote_task.seed, directory, choose_backend(remote_task.backend), report_progress
        )


def _register_parts(parts: Sequence[tuple[Source, str]]) -> None:
    """Load the third-party parts of a message; no source is read from the study.

    Raises PartError if a source does not match its hash.
    """
    for source, sha256 in parts:
        if source.sha256 != sha256:
            raise PartError(f"the {source.kind} {source.name!r} was damaged during transfer")
    # A file can contain several parts, and it is loaded once.
    file_by_text = {source.text: source.file for source, _ in parts}
    for text, file in file_by_text.items():
        load_text(text, Path(file))


def _progress_reporter(
    worker: Worker, agent_steps: int, topic: str, event_interval: float
) -> Callable[[int], None]:
    """Return a callback that sends the remaining agent-steps, and stops a canceled task."""
    key = worker.get_current_task()
    remaining = agent_steps
    last_report = time.monotonic()

    def report_progress(agent_steps_done: int) -> None:
        nonlocal remaining, last_report
        remaining -= agent_steps_done
        state = worker.state.tasks.get(key)
        if state is None or state.state == "cancelled":
            raise StoppedError
        if time.monotonic() - last_report > event_interval:
            last_report = time.monotonic()
            worker.log_event(topic, (key, remaining))

    return report_progress
