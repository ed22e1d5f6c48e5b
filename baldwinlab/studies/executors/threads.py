"""Executor on threads; compiled code runs without the interpreter lock, so all cores are used."""

from __future__ import annotations

import queue
import threading
from collections.abc import Generator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, Final

from baldwinlab.engine.threads import available_cores, defer_interruptions, use_threads
from baldwinlab.models.miniworld.backends.choice import Backend
from baldwinlab.studies.executors.tasks import Done, Executor, StoppedError, Task
from baldwinlab.studies.store import StudyStore


def count_threads_per_task(workers: int, tasks: int) -> int:
    """Return the number of threads of each task, above 1 if there are fewer tasks than workers."""
    return max(1, workers // max(1, tasks))


def run_on_threads(
    study: StudyStore, tasks: Sequence[Task], workers: int, backend: Backend, done: Done
) -> Generator[int, None, None]:
    """Execute the tasks on threads of this process. See `Executor.run`.

    If there are fewer tasks than workers, each task uses several threads.
    """
    threads_per_task = count_threads_per_task(workers, len(tasks))
    stop = threading.Event()
    events: queue.SimpleQueue[int | Future[Any]] = queue.SimpleQueue()

    def report_progress(agent_steps: int) -> None:
        if stop.is_set():
            raise StoppedError
        events.put(agent_steps)

    def run_task(task: Task) -> Any:
        with use_threads(threads_per_task):
            return task.run(study.seed, study.directory, backend, report_progress)

    pool = ThreadPoolExecutor(workers)
    try:
        with defer_interruptions():
            unfinished = {pool.submit(run_task, task): task for task in tasks}
            for future in unfinished:
                future.add_done_callback(events.put)
        while unfinished:
            # A finished task, or the agent-steps that a task has done.
            event = events.get()
            if isinstance(event, Future):
                done(unfinished.pop(event), event.result())
            else:
                yield event
    finally:
        with defer_interruptions():
            stop.set()
            pool.shutdown(wait=False, cancel_futures=True)
        # Only this wait can be interrupted. All tasks end soon, because `stop` is set.
        pool.shutdown()


THREADS: Final = Executor(name="threads", workers=available_cores(), work=run_on_threads)
