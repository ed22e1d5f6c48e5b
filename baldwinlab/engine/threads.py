"""The number of cores and of threads, and functions that call compiled code in these threads."""

from __future__ import annotations

import math
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from contextvars import ContextVar
from typing import Final, NamedTuple

from numba import config

from baldwinlab.core.resources import cores_of_groups

# Maximum number of threads for work in the current context.
_THREADS: Final[ContextVar[int]] = ContextVar("threads", default=1)


class SharedThreads(NamedTuple):
    """Threads that execute the ranges of indices of several tasks."""

    pool: ThreadPoolExecutor
    n_ranges: int  # Maximum number of ranges of a call.


_SHARED_THREADS: Final[ContextVar[SharedThreads | None]] = ContextVar("shared", default=None)
# Signals with handlers that raise KeyboardInterrupt. Windows has no SIGALRM.
_INTERRUPTIONS: Final = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGALRM") if hasattr(signal, name)
)


def available_cores() -> int:
    """Return the number of cores that this process may use, at least 1.

    The smallest limit applies: the affinity of the process or the variable PYTHON_CPU_COUNT, and
    the quotas of its control groups, such as that of a container. A quota of 1.5 cores counts as 2.
    """
    return max(1, math.ceil(min([_count_process_cores(), *cores_of_groups()])))


def _count_process_cores() -> int:
    """Return the result of `os.process_cpu_count`, which Python has since version 3.13."""
    if hasattr(os, "process_cpu_count"):
        return os.process_cpu_count() or 1
    if (count := os.environ.get("PYTHON_CPU_COUNT", "")).isdecimal():
        return int(count)
    if hasattr(os, "sched_getaffinity"):
        this_process = 0
        return len(os.sched_getaffinity(this_process))
    return os.cpu_count() or 1


@contextmanager
def use_threads(count: int) -> Iterator[None]:
    """Allow `count` threads for work in this context. `count_threads` gives small work fewer."""
    token = _THREADS.set(count)
    try:
        yield
    finally:
        _THREADS.reset(token)


def count_threads(size: int, minimum_size: int) -> int:
    """Return the number of threads for `size` entries, at least `minimum_size` for each thread.

    Plain Python, and work on fewer entries than `minimum_size`, use one thread.
    """
    return 1 if config.DISABLE_JIT else max(1, min(_THREADS.get(), size // minimum_size))


@contextmanager
def share_threads(shared: SharedThreads | None) -> Iterator[None]:
    """Let threads of a pool execute the ranges of `run_in_ranges` in this context."""
    token = _SHARED_THREADS.set(shared)
    try:
        yield
    finally:
        _SHARED_THREADS.reset(token)


@contextmanager
def defer_interruptions() -> Iterator[None]:
    """Delay an interruption until the end of this context.

    The Python code of threads and futures acquires locks. If an interruption raises an exception in
    this code, a lock stays acquired, and the threads that wait for the lock never end.
    """
    arrived: list[int] = []
    try:
        with ExitStack() as handlers:
            # Only the main thread handles signals.
            if threading.current_thread() is threading.main_thread():
                for number in _INTERRUPTIONS:
                    handler = signal.getsignal(number)
                    # Only a handler in Python can raise an exception.
                    if callable(handler):
                        handlers.callback(signal.signal, number, handler)
                        signal.signal(number, lambda number, _: arrived.append(number))
            yield
    finally:
        for number in arrived:
            signal.raise_signal(number)


def run_in_threads(function: Callable[[int], None], threads: int) -> None:
    """Call `function(thread)` for the threads 0 to `threads` - 1, all at the same time.

    An interruption is raised after all calls.
    """
    if threads == 1:
        function(0)
        return
    # The calling thread is thread 0, so the pool has one thread less.
    with defer_interruptions(), ThreadPoolExecutor(threads - 1) as pool:
        futures = [pool.submit(function, thread) for thread in range(1, threads)]
        function(0)
        # `result` raises the exception of a call that failed.
        for future in futures:
            future.result()


def run_in_ranges(function: Callable[[int, int], None], size: int, minimum_size: int) -> None:
    """Call `function(first, end)` for ranges of indices that together cover 0 to `size` - 1.

    Each thread calls the function for one range. A range has at least `minimum_size` entries,
    unless `size` is smaller.
    """
    shared = _SHARED_THREADS.get()
    maximum = _THREADS.get() if shared is None else shared.n_ranges
    n_ranges = 1 if config.DISABLE_JIT else max(1, min(maximum, size // minimum_size))

    def run_range(index: int) -> None:
        function(size * index // n_ranges, size * (index + 1) // n_ranges)

    if shared is None or n_ranges == 1:
        run_in_threads(run_range, n_ranges)
        return
    for _ in shared.pool.map(run_range, range(n_ranges)):
        pass
