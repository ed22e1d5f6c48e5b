"""An interruption at any moment stops the threads of a study."""

from __future__ import annotations

import subprocess
import sys

# Interrupts the main thread when its function number N returns, for all N until the first event.
INTERRUPTED_TASKS = """
import signal, sys, time
from types import SimpleNamespace
from baldwinlab.studies.executors.tasks import run_on_threads


class Task:
    def run(self, seed, directory, backend, report_progress):
        # Only an interruption ends the task.
        while True:
            report_progress(1)
            time.sleep(0.001)


def interrupt(number):
    returns = 0

    def trace(frame, event, argument):
        nonlocal returns
        # Without the generator's own returns, after which no code of it would run.
        returns += event == "return" and frame.f_code is not run_on_threads.__code__
        if returns == number:
            sys.settrace(None)
            signal.raise_signal(signal.SIGINT)
        return trace

    study = SimpleNamespace(seed=1, directory=None)
    events = run_on_threads(study, [Task(), Task(), Task()], 2, None, None)
    sys.settrace(trace)
    try:
        next(events)
        return False
    except KeyboardInterrupt:
        return True
    finally:
        sys.settrace(None)
        events.close()


# A shell ignores the signal in background jobs.
signal.signal(signal.SIGINT, signal.default_int_handler)
number = 1
while interrupt(number):
    number += 1
print(number)
"""


def test_an_interruption_at_any_moment_of_the_start_stops_all_threads() -> None:
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTED_TASKS],
        capture_output=True,
        text=True,
        # The limit only ends a program that hangs.
        timeout=180,
    )
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > 50
