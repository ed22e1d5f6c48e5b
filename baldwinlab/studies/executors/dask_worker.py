"""Execution of a task on a Dask worker.

A task is sent as plain data with its third-party parts. The worker stores records itself, and
reports its progress by events of the scheduler.
"""

from __future__ import annotations

import pickle
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from threading import Lock
from typing import Any, Final, NamedTuple

import dask.config
from distributed import Worker, get_worker

from baldwinlab.core.errors import PartError
from baldwinlab.core.files import is_study, parse_location
from baldwinlab.engine.cache import engine_hash
from baldwinlab.models.miniworld.backends.choice import choose_backend
from baldwinlab.parts.loading import Source, load_text
from baldwinlab.studies.executors.tasks import StoppedError, Task
from baldwinlab.studies.records import StudyError

# Hash of the sources of the engine and the version of Numba.
ENGINE_HASH: Final = engine_hash()

# The registry of parts belongs to the process, so one thread loads parts at a time.
LOADING_LOCK: Final = Lock()


class RemoteTask(NamedTuple):
    """Message to a worker; it is sent as pickled bytes, which Dask does not inspect."""

    task: bytes  # The pickled task. Its classes are available only after the parts are loaded.
    parts: tuple[tuple[Source, str], ...]  # Sources of third-party parts, each with its SHA-256.
    seed: int
    directory: str
    backend: str
    engine: str  # Hash of the engine, which must match that of the worker.
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
            raise PartError(f"the {source.kind} {source.name!r} was damaged during transfer")
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
