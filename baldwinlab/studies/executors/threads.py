"""Threads of this process: compiled code runs without the interpreter lock, so they keep all cores busy."""

from __future__ import annotations

import queue
import threading
from collections.abc import Generator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Final

from baldwinlab.models.miniworld.backend import Backend
from baldwinlab.runs.warm_up import available_cores
from baldwinlab.studies.executors.tasks import Executor, StoppedError, Task, do
from baldwinlab.studies.store import Study


def threads(study: Study, tasks: Sequence[Task], workers: int, backend: Backend) -> Generator[int, None, None]:
    """Do the tasks on so many threads. See `Executor`."""
    stop = threading.Event()
    news: queue.SimpleQueue[int | Future[None]] = queue.SimpleQueue()

    def lived(agent_steps: int) -> None:
        if stop.is_set():
            raise StoppedError
        news.put(agent_steps)

    with ThreadPoolExecutor(workers) as pool:
        left = len(tasks)
        for task in tasks:
            pool.submit(do, task, study.seed, study.directory, backend, lived).add_done_callback(news.put)
        try:
            while left:
                item = news.get()
                if isinstance(item, Future):
                    item.result()
                    left -= 1
                else:
                    yield item
        finally:
            stop.set()
            pool.shutdown(wait=True, cancel_futures=True)


THREADS: Final = Executor("threads", available_cores(), threads)
