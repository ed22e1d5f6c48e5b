"""Options of execution: workers, backend, executor and the resource check."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from threading import Lock
from typing import TYPE_CHECKING

from baldwinlab.core.errors import RefusedError
from baldwinlab.core.numbers import require_whole_number
from baldwinlab.core.resources import Need
from baldwinlab.studies import executors
from baldwinlab.studies.executors import THREADS, Executor

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class RunOptions:
    """Options of execution. They do not change results."""

    # Number of threads, or of jobs with the executor "slurm"; by default one thread per core.
    workers: int | None = None
    backend: str = "auto"  # "cpu", "cuda", or "auto" for the fastest that is available.
    executor: str = "threads"  # "threads", "dask:tcp://HOST:PORT", or "slurm".
    force: bool = False  # Run even if less memory or disk is free than the estimate.
    # Interval between two checkpoints of a run: seconds, such as "60s", or generations, such as
    # "100".
    checkpoint: str = "60s"
    # Called after each generation of a run with the dataset of the run; only with the executor
    # "threads".
    callback: Callable[[xr.Dataset], None] | None = None

    def __post_init__(self) -> None:
        """Raise ArgumentError for an invalid number of workers, before anything is written."""
        if self.workers is not None:
            require_whole_number("workers", self.workers)

    def make_executor(self) -> Executor:
        """Return the executor."""
        if self.callback and self.executor != THREADS.name:
            raise RefusedError(
                "a callback runs on this machine only: leave it out, or use 'threads', "
                f"not {self.executor!r}"
            )
        return executors.choose_executor(self.executor, self.workers)

    def make_callback(self) -> Callable[[xr.Dataset], None] | None:
        """Return the callback, protected by a lock: one call runs at a time."""
        callback = self.callback
        if callback is None:
            return None
        return partial(_call_alone, Lock(), callback)


def _call_alone(lock: Lock, callback: Callable[[xr.Dataset], None], dataset: xr.Dataset) -> None:
    """Call a function while no other thread calls it."""
    with lock:
        callback(dataset)


def exclude_remote_memory(need: Need, executor: Executor) -> Need:
    """Return the need on this machine: without memory if the workers are remote."""
    is_local = executor.name == THREADS.name
    return need if is_local else need._replace(memory=0)
