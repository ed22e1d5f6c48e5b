"""Threads of this process: compiled code runs without the interpreter lock, so they keep all cores busy."""

from __future__ import annotations

import queue
import threading
from collections.abc import Generator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, Final

from baldwinlab.models.miniworld.backends.choice import Backend
from baldwinlab.simulation.compilation import available_cores
from baldwinlab.studies.executors.tasks import Done, Executor, StoppedError, Task
from baldwinlab.studies.store import StudyStore


def run_on_threads(
    study: StudyStore, tasks: Sequence[Task], workers: int, backend: Backend, done: Done
) -> Generator[int, None, None]:
    """Do the tasks on so many threads. See `Executor`."""
    stop = threading.Event()
    news: queue.SimpleQueue[int | Future[Any]] = queue.SimpleQueue()

    def lived(agent_steps: int) -> None:
        if stop.is_set():
            raise StoppedError
        news.put(agent_steps)

    with ThreadPoolExecutor(workers) as pool:
        left = {
            pool.submit(task.run, study.seed, study.directory, backend, lived): task
            for task in tasks
        }
        for future in list(left):
            future.add_done_callback(news.put)
        try:
            while left:
                item = news.get()
                if isinstance(item, Future):
                    done(left.pop(item), item.result())
                else:
                    yield item
        finally:
            stop.set()
            pool.shutdown(wait=True, cancel_futures=True)


THREADS: Final = Executor("threads", available_cores(), run_on_threads)
