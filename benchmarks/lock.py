"""Time of a command inside and outside of the interpreter's lock: `python -m benchmarks.lock`.

    python -m benchmarks.lock FILE THREADS COMMAND ...

runs `baldwinlab COMMAND ...`, and writes its times as JSON into FILE. THREADS threads execute the
tasks of the study. With one thread and `--workers 16`, the study has the tasks of 16 workers, and
their times are correct.

Code that Numba compiled, checksums and the synchronization of files run without the lock of the
interpreter, so several threads can run them at the same time. The rest of the CPU time counts as
time under the lock, although NumPy and the writing of files also release it for a part of their
time. On the other hand, a compiled function reads its arguments under the lock.
"""

from __future__ import annotations

import hashlib
import json
import os
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from baldwinlab.api import run_study
from baldwinlab.cli import main as run_command
from baldwinlab.engine.numba_internals import dispatchers
from baldwinlab.studies.executors import run_on_threads


@dataclass(frozen=True)
class Times:
    """Seconds of a part of a process."""

    elapsed: float
    cpu: float  # CPU time of all threads.
    released: float  # CPU time in functions that release the lock.

    def __sub__(self, start: Times) -> Times:
        return Times(
            self.elapsed - start.elapsed, self.cpu - start.cpu, self.released - start.released
        )

    @property
    def under_lock(self) -> float:
        """CPU time outside of the functions that release the lock."""
        return self.cpu - self.released

    @property
    def serial_share(self) -> float:
        """Share of the CPU time that only one thread can use at a time, 0 to 1."""
        return self.under_lock / self.cpu


class Clock:
    """Times since the start of the process. It counts compiled functions looked up from now on.

    The time without the lock is correct if one thread at a time calls the functions.
    """

    def __init__(self) -> None:
        self._released = 0.0
        find = dispatchers.find_compiled_function
        dispatchers.find_compiled_function = lambda *arguments: self._measure(find(*arguments))
        for module, name in ((hashlib, "sha256"), (os, "fsync")):
            setattr(module, name, self._measure(getattr(module, name)))

    def _measure(self, function: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any) -> Any:
            start = time.thread_time()
            result = function(*arguments)
            self._released += time.thread_time() - start
            return result

        return call

    def read(self) -> Times:
        return Times(time.perf_counter(), time.process_time(), self._released)


def main() -> None:
    file, threads, *arguments = sys.argv[1:]
    clock = Clock()
    # The module that calls the function which simulates and stores the runs of a study.
    caller: Any = run_study
    simulate = caller.run_study
    sessions: list[Times] = []

    def execute(study: Any, tasks: Any, workers: int, backend: Any, done: Any) -> Any:
        return run_on_threads(study, tasks, int(threads), backend, done)

    def simulate_measured(*arguments: Any, **options: Any) -> None:
        executor = options["executor"]._replace(work=execute)
        start = clock.read()
        simulate(*arguments, **options | {"executor": executor})
        sessions.append(clock.read() - start)

    caller.run_study = simulate_measured
    sys.argv = ["baldwinlab", *arguments]
    try:
        run_command()
    finally:
        times = {"command": asdict(clock.read()), "session": asdict(sessions[0])}
        Path(file).write_text(json.dumps(times), "utf-8")


if __name__ == "__main__":
    main()
