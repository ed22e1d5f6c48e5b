"""Workers of a Dask cluster: one that is there already, or one whose workers are jobs of Slurm.

A task goes out as plain data, with the foreign parts it needs. Its worker stores records itself, so no record passes through the
scheduler; what a task returns does. A worker says how far it is by events of the scheduler: of all tasks together few a second,
however many workers there are.
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

CONNECTION_TIMEOUT: Final = 10  # seconds to wait for a scheduler, also for one that was lost
EVENTS_PER_SECOND: Final = 100  # from all tasks together
BATCH: Final = 1000  # tasks in one message to the scheduler
EVENT_INTERVAL: Final = 2.0  # seconds between two events of a task, at least
ENGINE: Final = sources_hash()  # carries a hash of the engine's sources and of Numba's version

LOADING: Final = Lock()  # parts are known by name to the whole process


class RemoteTask(NamedTuple):
    """What a worker is sent, pickled, so that Dask looks for nothing of its own in it."""

    task: bytes  # pickled by itself: what it is made of is known only when the parts are
    parts: tuple[tuple[Source, str], ...]  # with the SHA-256 of each
    seed: int
    directory: str
    backend: str
    engine: str
    topic: str
    silence: float  # seconds


def connect_dask(
    address: str,
    study: StudyStore,
    tasks: Sequence[Task],
    workers: int,
    backend: Backend,
    done: Done,
) -> Generator[int, None, None]:
    """Do the tasks on a Dask cluster, with the workers it has. See `Executor`."""
    with _connect(address) as client:
        yield from _run_tasks(client, study, tasks, backend, done)


def connect_slurm(
    jobs: int, study: StudyStore, tasks: Sequence[Task], workers: int, backend: Backend, done: Done
) -> Generator[int, None, None]:
    """Do the tasks on workers that are so many Slurm jobs, as Dask's configuration describes a job. See `Executor`."""
    with SLURMCluster() as cluster, Client(cluster, set_as_default=False) as client:
        _require_job(cluster.job_script())
        cluster.adapt(
            minimum_jobs=jobs, maximum_jobs=jobs
        )  # rather than scale: a job that ends early is replaced
        yield from _run_tasks(client, study, tasks, backend, done)


def _require_job(script: str) -> None:
    """Raises ExecutorError where Slurm would not take the job, for which Dask would wait without a word."""
    tried = subprocess.run(["sbatch", "--test-only"], input=script, capture_output=True, text=True)
    if tried.returncode != 0:
        raise ExecutorError(f"Slurm refuses the job: {tried.stderr.strip().splitlines()[-1]}")


def count_cores(address: str) -> int:
    """Cores of the cluster's workers. Raises RefusedError where no scheduler answers."""
    with _connect(address) as client:
        return sum(client.nthreads().values())


def count_job_cores() -> int:
    """Raises RefusedError where Dask's configuration does not say what a Slurm job is."""
    missing = [name for name in ("cores", "memory") if _job_setting(name) is None]
    if missing:
        names = " and ".join(f"jobqueue.slurm.{name}" for name in missing)
        raise RefusedError(
            f"--executor slurm needs {names} in Dask's configuration: what a job asks for, see docs/how-to/slurm.md"
        )
    return int(_job_setting("cores"))


def _job_setting(name: str) -> Any:
    return dask.config.get(f"jobqueue.slurm.{name}", None)


def _connect(address: str) -> Client:
    try:
        return Client(address, timeout=CONNECTION_TIMEOUT, set_as_default=False)
    except (OSError, ValueError, RuntimeError):
        raise RefusedError(
            f"no Dask scheduler answers at {address}; one is started by `dask scheduler`"
        ) from None


def _run_tasks(
    client: Client, study: StudyStore, tasks: Sequence[Task], backend: Backend, done: Done
) -> Generator[int, None, None]:
    """Submit the tasks and yield the agent-steps done: what workers tell, and when a task has ended, the rest of it.

    A task that was lost with its worker begins again; nothing is yielded until it is further than it was.
    """
    news: queue.SimpleQueue[Future | tuple[str, int]] = queue.SimpleQueue()
    topic = f"baldwinlab-{uuid4().hex}"
    client.subscribe_topic(topic, lambda event: news.put(event[1]))
    ordered = {f"{topic}-{number}": task for number, task in enumerate(tasks)}
    left = {key: task.agent_steps for key, task in ordered.items()}
    orders = _pack_tasks(study, tasks, backend, topic)
    futures = {
        future.key: future
        for future in client.map(_run_task, orders, key=list(left), pure=False, batch_size=BATCH)
    }
    try:
        for future in futures.values():
            future.add_done_callback(news.put)
        while futures:
            item = news.get()
            key, still_to_do = (item.key, 0) if isinstance(item, Future) else item
            if isinstance(item, Future):
                done(ordered[key], _get_result(item))
                del futures[key]  # the scheduler forgets it
            if still_to_do < left[key]:
                yield left[key] - still_to_do
                left[key] = still_to_do
    finally:
        client.cancel(list(futures.values()))


def _pack_tasks(
    study: StudyStore, tasks: Sequence[Task], backend: Backend, topic: str
) -> list[bytes]:
    """The tasks as they are sent."""
    directory = str(study.directory.absolute() if is_local(study.directory) else study.directory)
    sources = sources_of(experiment for task in tasks for experiment in task.experiments)
    parts = tuple((source, source.sha256) for source in sources)
    silence = max(EVENT_INTERVAL, len(tasks) / EVENTS_PER_SECOND)
    common = (parts, study.seed, directory, backend.name, ENGINE, topic, silence)
    return [pickle.dumps(RemoteTask(pickle.dumps(task), *common)) for task in tasks]


def _get_result(future: Future) -> Any:
    """What a task returned. Raises what it raised, and ExecutorError where it is not to be had any more."""
    try:
        return future.result()
    except CancelledError:
        raise ExecutorError("the Dask scheduler is gone") from None
    except KilledWorker as error:
        dead = error.allowed_failures + 1
        raise ExecutorError(
            f"a task was given up: {dead} workers died, one after the other, doing it"
        ) from None


def _run_task(sent: bytes) -> Any:
    """Do a task, on a worker. Raises StudyError where the worker does not see the study, or has another engine."""
    order: RemoteTask = pickle.loads(sent)
    worker = get_worker()
    if order.engine != ENGINE:
        raise StudyError(
            f"the worker {worker.address} has another version of baldwinlab or Numba than this process"
        )
    directory = parse_location(order.directory)
    if not is_study(directory):
        raise StudyError(
            f"the worker {worker.address} does not see {directory}: a study must lie where all workers see it"
        )
    with LOADING:
        _register_parts(order.parts)
        task: Task = pickle.loads(order.task)
    tell = _progress_reporter(worker, task.agent_steps, order.topic, order.silence)
    with dask.config.set(
        scheduler="synchronous"
    ):  # else xarray, when it writes, opens a client of its own in every worker
        return task.run(order.seed, directory, choose_backend(order.backend), tell)


def _register_parts(parts: Sequence[tuple[Source, str]]) -> None:
    """Load the foreign parts that came with an order from whoever gave their files; nothing is taken from the study.

    Raises PartError where a text is not the one that its hash stands for.
    """
    for source, sha256 in parts:
        if source.sha256 != sha256:
            raise PartError(
                f"the {source.kind} {source.name!r} did not arrive as it was sent: its SHA-256 is another"
            )
    for text, file in {source.text: source.file for source, _ in parts}.items():
        load_text(text, Path(file))


def _progress_reporter(
    worker: Worker, agent_steps: int, topic: str, silence: float
) -> Callable[[int], None]:
    """What is called with the agent-steps done: it tells now and then how many are left, and ends a task nobody waits for."""
    key, left, told = worker.get_current_task(), agent_steps, time.monotonic()

    def lived(amount: int) -> None:
        nonlocal left, told
        left -= amount
        state = worker.state.tasks.get(key)
        if state is None or state.state == "cancelled":
            raise StoppedError
        if time.monotonic() - told > silence:
            told = time.monotonic()
            worker.log_event(topic, (key, left))

    return lived
