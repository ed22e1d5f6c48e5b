"""Progress of the processes that run a study: one small hidden file per process.

    DIR/.running-HOST-PID.json

A process removes its file at the end of its session. The next session of the study removes the
files of killed processes. `status.py` reads the files.
"""

from __future__ import annotations

import json
import os
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Final, NamedTuple, Self

from pydantic import Field, TypeAdapter

from baldwinlab.core.file_writing import remove_file
from baldwinlab.core.files import RESULTS_FILE, find_paths, parse_json, read_text
from baldwinlab.studies.records import write_in_study

FILE_PREFIX: Final = ".running-"
# Interval between two writes, in seconds.
WRITE_INTERVAL: Final = 5.0
# A process on another machine counts as ended if its file has not changed for this time. The time
# is long, because one generation of a large run can take minutes.
MAX_SILENCE_IN_SECONDS: Final = 600.0

# Numbers in a JSON file of a study, which another program can have changed.
Count = Annotated[int, Field(ge=0, lt=2**63, strict=True)]
Amount = Annotated[float, Field(ge=0, lt=2**63, strict=True)]


class ProcessProgress(NamedTuple):
    """Progress of one process."""

    host: str
    pid: Annotated[int, Field(gt=0, lt=2**31)]
    began: Amount  # Time of the start of the simulation, in seconds since 1970.
    updated: Amount  # Time of the last write, in seconds since 1970.
    workers: Count  # Number of tasks that are executed in parallel.
    executor: str
    backend: str
    runs: Count  # Number of runs of all conditions together, when the process ends.
    agent_steps: Count  # Number of agent-steps that the process must simulate.
    agent_steps_done: Count = 0  # Number of these agent-steps that are finished.
    # Duration from the start to the last write, in seconds. The clock of `began` and `updated` can
    # be set during a simulation.
    seconds: Amount = 0.0

    @classmethod
    def begin(
        cls, workers: int, executor: str, backend: str, *, runs: int, agent_steps: int
    ) -> Self:
        """Return the progress of this process at its start."""
        now = time.time()
        host = socket.gethostname()
        return cls(host, os.getpid(), now, now, workers, executor, backend, runs, agent_steps)

    @property
    def file_name(self) -> str:
        """Name of the file of the process."""
        host = "".join(letter if letter.isalnum() else "-" for letter in self.host)
        return f"{FILE_PREFIX}{host}-{self.pid}.json"

    @property
    def is_running(self) -> bool:
        """Whether the process still runs; on another machine, whether its file is recent."""
        if self.host != socket.gethostname():
            # The clocks of two machines can differ, in both directions.
            return abs(time.time() - self.updated) < MAX_SILENCE_IN_SECONDS
        try:
            # Signal 0 only checks whether the process exists.
            os.kill(self.pid, 0)
        except ProcessLookupError:
            return False
        except PermissionError:
            # The process exists, and belongs to another user.
            return True
        return True

    @property
    def steps_per_second(self) -> float:
        """Mean number of agent-steps per second since the start, 0 if it is unknown."""
        return compute_rate(self.agent_steps_done, self.seconds)


def compute_rate(agent_steps: int, seconds: float) -> float:
    """Return the number of agent-steps per second, 0 if no time has passed."""
    return agent_steps / seconds if seconds > 0 else 0.0


class ProgressFile:
    """Write the progress of this process, at most once per `WRITE_INTERVAL`.

    `count_workers`: function that returns the present number of workers, or raises OSError. It is
    None if the number of workers does not change.
    """

    def __init__(
        self,
        directory: Path,
        progress: ProcessProgress,
        count_workers: Callable[[], int] | None = None,
    ) -> None:
        self._directory = directory
        self._progress = progress
        self._count_workers = count_workers
        self._path = directory / progress.file_name
        self._started_at = time.monotonic()
        self._write()

    def add(self, agent_steps: int) -> None:
        """Count finished agent-steps, and write the file if `WRITE_INTERVAL` has passed."""
        done = self._progress.agent_steps_done + agent_steps
        self._progress = self._progress._replace(agent_steps_done=done)
        seconds_since_write = time.monotonic() - self._started_at - self._progress.seconds
        if seconds_since_write < WRITE_INTERVAL:
            return
        if self._count_workers:
            # If the cluster is lost, the executor raises an error with a better message.
            with suppress(OSError):
                self._progress = self._progress._replace(workers=self._count_workers())
        self._write()

    def _write(self) -> None:
        seconds = time.monotonic() - self._started_at
        self._progress = self._progress._replace(updated=time.time(), seconds=seconds)
        content = json.dumps(self._progress._asdict()).encode()
        # If the study cannot be written, the next record raises an error with a better message.
        with suppress(OSError):
            write_in_study(self._directory, self._path, content)

    def close(self) -> None:
        """Remove the file."""
        with suppress(OSError):
            remove_file(self._path)


def read_progress(directory: Path) -> Iterator[tuple[Path, ProcessProgress]]:
    """Yield the path and the content of the file of each process. Invalid files are skipped."""
    for path in find_paths(directory, f"{FILE_PREFIX}*.json"):
        with suppress(OSError, ValueError):
            content = parse_json(read_text(path, RESULTS_FILE))
            yield path, TypeAdapter(ProcessProgress).validate_python(content)


def remove_ended_processes(directory: Path) -> None:
    """Remove the files of processes that were killed."""
    for path, progress in read_progress(directory):
        if not progress.is_running:
            remove_file(path)
