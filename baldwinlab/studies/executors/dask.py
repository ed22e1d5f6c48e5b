"""Executors on a Dask cluster: an existing one, or one whose workers are Slurm jobs.

A task is sent as plain data with its third-party parts. A worker stores records itself. Only the
result of a task passes through the scheduler. Workers report their progress by events of the
scheduler, whose total rate is limited for any number of workers.
"""

from __future__ import annotations

import pickle
import queue
import subprocess
import time
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import CancelledError
from pathlib import Path
from threading import Lock
from typing import Any, Final, NamedTuple
from uuid import uuid4

import dask.config
from dask_jobqueue import SLURMCluster
from distributed import Client, Future, KilledWorker, Worker, get_worker

from baldwinlab.core.errors import PartError, RefusedError
from baldwinlab.core.files import is_local, parse_location
from baldwinlab.core.output_paths import is_study
from baldwinlab.engine.cache import sources_hash
from baldwinlab.models.miniworld.backends.choice import Backend, choose_backend
from baldwinlab.parts.loading import Source, load_text, sources_of
from baldwinlab.studies.executors.tasks import Done, ExecutorError, StoppedError, Task
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore

# Timeout of a connection to a scheduler, in seconds.
CONNECTION_TIMEOUT: Final = 10
# Maximum rate of progress events of all tasks.
EVENTS_PER_SECOND: Final = 100
# Number of tasks in one message to the scheduler.
TASKS_PER_MESSAGE: Final = 1000
# Minimum time between two events of a task, in seconds.
MIN_EVENT_INTERVAL: Final = 2.0
# Hash of the sources of the engine and the version of Numba.
ENGINE_HASH: Final = sources_hash()

# The registry of parts belongs to the process, so one thread loads parts at a time.
LOADING_LOCK: Final = Lock()


class RemoteTask(NamedTuple):
    """Message to a worker; it is sent as pickled bytes, which Dask does not inspect.

    Attributes
    ----------
    task : bytes
        The pickled task. Its classes are available only after the parts are loaded.
    parts : tuple
        Sources of third-party parts, each with its SHA-256.
    seed : int
        The seed of the study.
    directory : str
        The directory of the study.
    backend : str
        Name of the backend.
    engine : str
        Hash of the engine, which must match that of the worker.
    topic : str
        Topic of the progress events.
    event_interval : float
        Minimum time between two events of this task, in seconds.
    """

    task: bytes
    parts: tuple[tuple[Source, str], ...]
    seed: int
    directory: str
    backend: str
    engine: str
    topic: str
    event_interval: float


def run_on_dask(
    address: str,
    study: StudyStore,
    tasks: Sequence[Task],
    workers: int,
    backend: Backend,
    done: Done,
) -> Generator[int, None, None]:
    """Execute the tasks on the workers of a Dask cluster. See `Executor.run`."""
    with _connect(address) as client:
        yield from _run_tasks(client, study, tasks, backend, done)


def run_on_slurm(
    jobs: int, study: StudyStore, tasks: Sequence[Task], workers: int, backend: Backend, done: Done
) -> Generator[int, None, None]:
    """Execute the tasks on Slurm jobs, which Dask's configuration describes. See `Executor.run`."""
    with SLURMCluster() as cluster, Client(cluster, set_as_default=False) as client:
        _require_job(cluster.job_script())
        # Unlike `scale`, `adapt` replaces a job that ends early.
        cluster.adapt(minimum_jobs=jobs, maximum_jobs=jobs)
        yield from _run_tasks(client, study, tasks, backend, done)


def _require_job(script: str) -> None:
    """Raise ExecutorError if Slurm rejects the job; Dask would wait for it without a message."""
    test = subprocess.run(["sbatch", "--test-only"], input=script, capture_output=True, text=True)
    if test.returncode != 0:
        reason = test.stderr.strip().splitlines()[-1]
        raise ExecutorError(f"Slurm refuses the job: {reason}")


def count_cores(address: str) -> int:
    """Return the number of cores of a cluster. Raises RefusedError if no scheduler answers."""
    with _connect(address) as client:
        return sum(client.nthreads().values())


def count_job_cores() -> int:
    """Return the number of cores of a Slurm job.

    Raises RefusedError if Dask's configuration does not describe a job.
    """
    missing = [name for name in ("cores", "memory") if _job_setting(name) is None]
    if missing:
        names = " and ".join(f"jobqueue.slurm.{name}" for name in missing)
        raise RefusedError(
            f"--executor slurm needs {names} in Dask's configuration: the resources of a job, "
            "see docs/how-to/slurm.md"
        )
    return int(_job_setting("cores"))


def _job_setting(name: str) -> Any:
    return dask.config.get(f"jobqueue.slurm.{name}", None)


def _connect(address: str) -> Client:
    try:
        return Client(address, timeout=CONNECTION_TIMEOUT, set_as_default=False)
    except (OSError, ValueError, RuntimeError):
        raise RefusedError(
            f"no Dask scheduler answers at {address}; start one with `dask scheduler`"
        ) from None


def _run_tasks(
    client: Client, study: StudyStore, tasks: Sequence[Task], backend: Backend, done: Done
) -> Generator[int, None, None]:
    """Submit the tasks and yield the agent-steps done.

    Workers report the remaining agent-steps of a task. The end of a task adds the agent-steps that
    were not reported. A task of a lost worker restarts. It adds agent-steps only after it has
    passed the progress of its first attempt.
    """
    events: queue.SimpleQueue[Future | tuple[str, int]] = queue.SimpleQueue()
    topic = f"baldwinlab-{uuid4().hex}"

    def queue_progress(event: tuple[Any, tuple[str, int]]) -> None:
        _, progress = event
        events.put(progress)

    client.subscribe_topic(topic, queue_progress)
    tasks_by_key = {f"{topic}-{index}": task for index, task in enumerate(tasks)}
    remaining = {key: task.agent_steps for key, task in tasks_by_key.items()}
    messages = _pack_tasks(study, tasks, backend, topic)
    futures = {
        future.key: future
        for future in client.map(
            _run_task, messages, key=list(remaining), pure=False, batch_size=TASKS_PER_MESSAGE
        )
    }
    try:
        for future in futures.values():
            future.add_done_callback(events.put)
        while futures:
            event = events.get()
            if isinstance(event, Future):
                key = event.key
                remaining_steps = 0
                done(tasks_by_key[key], _get_result(event))
                # Without the last reference, the scheduler releases the task.
                del futures[key]
            else:
                key, remaining_steps = event
            if remaining_steps < remaining[key]:
                yield remaining[key] - remaining_steps
                remaining[key] = remaining_steps
    finally:
        client.cancel(list(futures.values()))


def _pack_tasks(
    study: StudyStore, tasks: Sequence[Task], backend: Backend, topic: str
) -> list[bytes]:
    """Return the pickled message of each task."""
    directory = str(study.directory.absolute() if is_local(study.directory) else study.directory)
    sources = sources_of(experiment for task in tasks for experiment in task.experiments)
    parts = tuple((source, source.sha256) for source in sources)
    messages = []
    for task in tasks:
        message = RemoteTask(
            task=pickle.dumps(task),
            parts=parts,
            seed=study.seed,
            directory=directory,
            backend=backend.name,
            engine=ENGINE_HASH,
            topic=topic,
            event_interval=max(MIN_EVENT_INTERVAL, len(tasks) / EVENTS_PER_SECOND),
        )
        messages.append(pickle.dumps(message))
    return messages


def _get_result(future: Future) -> Any:
    """Return the result of a task.

    Raises the error of the task, and ExecutorError if the cluster has lost it.
    """
    try:
        return future.result()
    except CancelledError:
        raise ExecutorError("the connection to the Dask scheduler is lost") from None
    except KilledWorker as error:
        attempts = error.allowed_failures + 1
        raise ExecutorError(f"a task failed: it has ended {attempts} workers in turn") from None


def _run_task(message: bytes) -> Any:
    """Execute a task on a worker.

    Raises StudyError if the worker cannot access the study, or has a different engine.
    """
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
    # With another scheduler, xarray opens a Dask client in every worker when it writes.
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
            raise PartError(
                f"the {source.kind} {source.name!r} was changed during transfer: "
                "its SHA-256 does not match"
            )
    # A file can contain several parts, and it is loaded once.
    file_by_text = {source.text: source.file for source, _ in parts}
    for text, file in file_by_text.items():
        load_text(text, Path(file))


def _progress_reporter(
    worker: Worker, agent_steps: int, topic: str, event_interval: float
) -> Callable[[int], None]:
    """Return a callback that sends the remaining agent-steps, and ends a canceled task."""
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
