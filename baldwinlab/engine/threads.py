"""Threads of a task: their number, and calls of compiled code in all of them."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from contextvars import ContextVar
from typing import Final

from numba import config

_THREADS: Final[ContextVar[int]] = ContextVar("threads", default=1)
# Signals whose handlers raise KeyboardInterrupt. Windows has no alarms.
_INTERRUPTIONS: Final = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGALRM") if hasattr(signal, name)
)


def available_cores() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        this_process = 0
        return len(os.sched_getaffinity(this_process))
    return os.cpu_count() or 1


@contextmanager
def use_threads(count: int) -> Iterator[None]:
    """Let the work of this context use `count` threads, where it is large enough."""
    token = _THREADS.set(count)
    try:
        yield
    finally:
        _THREADS.reset(token)


def count_threads(size: int, minimum_size: int) -> int:
    """Return the number of threads for work on `size` entries, at least `minimum_size` each.

    Plain Python uses one thread.
    """
    return 1 if config.DISABLE_JIT else max(1, min(_THREADS.get(), size // minimum_size))


@contextmanager
def defer_interruptions() -> Iterator[None]:
    """Raise an interruption that arrives in this context at its end.

    A thread and a future have locks in Python code. An exception between two of its instructions
    leaves a lock acquired, and the threads that wait for it never end.
    """
    arrived: list[int] = []
    try:
        with ExitStack() as handlers:
            # Only the main thread handles signals.
            if threading.current_thread() is threading.main_thread():
                for number in _INTERRUPTIONS:
                    handler = signal.getsignal(number)
                    # Python code handles the signal.
                    if callable(handler):
                        handlers.callback(signal.signal, number, handler)
                        signal.signal(number, lambda number, _: arrived.append(number))
            yield
    finally:
        for number in arrived:
            signal.raise_signal(number)


def run_in_threads(function: Callable[[int], None], threads: int) -> None:
    """Call `function` with the numbers 0 to `threads` - 1, each in a thread, at the same time.

    An interruption is raised after the calls.
    """
    if threads == 1:
        function(0)
        return
    with defer_interruptions(), ThreadPoolExecutor(threads - 1) as pool:
        futures = [pool.submit(function, thread) for thread in range(1, threads)]
        function(0)
        for future in futures:
            future.result()


def run_in_ranges(function: Callable[[int, int], None], size: int, minimum_size: int) -> None:
    """Call `function` with the first number and the end of ranges that cover `size` entries.

    The threads of the context call it at the same time. A range has at least `minimum_size` entries
    if `size` does.
    """
    threads = count_threads(size, minimum_size)

    def run_range(thread: int) -> None:
        function(size * thread // threads, size * (thread + 1) // threads)

    run_in_threads(run_range, threads)
