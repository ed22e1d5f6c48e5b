"""A process that has imported the command line, and forks for each command.

The start of an interpreter takes a second, and a fork a few milliseconds. The process reads a JSON
line per command from its input, and writes the exit status of the command as a line.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import time
import traceback
from pathlib import Path

import psutil

MODULES = [
    "matplotlib.pyplot",
    "baldwinlab.api.publish.study",
    "baldwinlab.analysis.report.tables",
    "baldwinlab.parts",
    "baldwinlab.lab.sources.freezer",
    "baldwinlab.lab.sources.studies",
]
# A command hangs after these seconds of CPU time, and after these seconds without any CPU time. So
# the result does not depend on the load of the machine.
TIMEOUT = 10.0
# A command that polls uses some CPU time, and hangs after these seconds.
LONGEST_TIMEOUT = 120.0
HANGS = "hangs"


def list_in_lab(root: str) -> None:
    """Print the lists of the lab, as the server sends them."""
    from baldwinlab.lab import Lab
    from baldwinlab.lab.sources import freezer, studies
    from baldwinlab.lab.sources.live import Live

    lab = Lab(Path(root), Live())
    lists = studies.list_studies(lab, {}) | freezer.list_files(lab, {})
    sys.stdout.write(json.dumps(lists, allow_nan=False, ensure_ascii=False))


def execute(arguments: list[str], folder: str) -> None:
    """Execute a command in a child process, and end the process."""
    status = 1
    try:
        for number, name in enumerate(("/dev/null", "out", "err")):
            mode = os.O_RDWR if number == 0 else os.O_WRONLY | os.O_CREAT | os.O_TRUNC
            os.dup2(os.open(Path(folder, "output", name), mode), number)
        os.chdir(Path(folder, "work"))
        if arguments[0] == "lab":
            list_in_lab(arguments[1])
        else:
            from baldwinlab.__main__ import main

            sys.argv = ["baldwinlab", *arguments]
            main()
        status = 0
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)


def wait(process: int) -> int | str:
    """Return the exit status of a process, or HANGS after one of the timeouts."""
    start = last_change = time.monotonic()
    cpu_seconds = 0.0
    while not is_hanging(cpu_seconds, start, last_change):
        ended, status = os.waitpid(process, os.WNOHANG)
        if ended:
            return os.waitstatus_to_exitcode(status)
        user, system, *_ = psutil.Process(process).cpu_times()
        if user + system > cpu_seconds:
            cpu_seconds, last_change = user + system, time.monotonic()
        time.sleep(0.005)
    for _ in range(2):
        os.killpg(process, signal.SIGINT)
        time.sleep(1)
    os.killpg(process, signal.SIGKILL)
    os.waitpid(process, 0)
    return HANGS


def is_hanging(cpu_seconds: float, start: float, last_change: float) -> bool:
    """Return whether a process has used too much CPU time, or none for too long."""
    now = time.monotonic()
    return max(cpu_seconds, now - last_change) > TIMEOUT or now - start > LONGEST_TIMEOUT


def serve() -> None:
    """Execute the commands of the input."""
    for module in MODULES:
        __import__(module)
    for line in sys.stdin:
        request = json.loads(line)
        process = os.fork()
        if process == 0:
            os.setsid()
            execute(request["arguments"], request["folder"])
        sys.stdout.write(f"{wait(process)}\n")
        sys.stdout.flush()


if __name__ == "__main__":
    serve()
