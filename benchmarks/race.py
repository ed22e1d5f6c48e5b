"""Measure contenders in turns, each in a fresh process.

A temporary load of the machine slows all contenders, so ratios within a round are more reliable
than rates.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryFile
from types import TracebackType
from typing import IO, Any, Self

from benchmarks.setting import Genomes, Setting

ROOT = Path(__file__).parent.parent
# Smallest duration of a measurement, in seconds.
MIN_MEASUREMENT_SECONDS = 0.3
ALLOCATOR = {"MALLOC_TRIM_THRESHOLD_": "100000000", "MALLOC_MMAP_THRESHOLD_": "100000000"}
"""Settings of glibc against returning freed memory, which slows NumPy by up to 40 %."""


@dataclass(frozen=True)
class Entry:
    """A contender, its cores and its task."""

    contender: str
    setting: Setting
    genomes: Genomes = field(repr=False)
    cores: int = 1


@dataclass
class Record:
    """The measurements of an entry."""

    contender: str
    scenario: str
    cores: int
    agent_steps_of_call: int = 0
    # Agent-steps per second, one value per round.
    rates: list[float] = field(default_factory=list)
    # From the start of the process to the first result.
    first_seconds: float = 0.0
    peak_mib: float = 0.0
    # Items per agent, averaged over all calls.
    eaten: float | None = None
    # Why nothing was measured.
    not_measured: str = ""


class Process:
    """A worker process, which ends with the context."""

    def __init__(self, entry: Entry) -> None:
        self.entry = entry
        self._errors = TemporaryFile("w+", encoding="utf-8")  # noqa: SIM115
        command = [sys.executable, "-m", "benchmarks.worker", entry.contender]
        path = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
        environment = {
            **os.environ,
            **ALLOCATOR,
            "PYTHONPATH": path,
            "JAX_PLATFORMS": "cpu",
        }
        pipes: Any = {
            "stdin": subprocess.PIPE,
            "stdout": subprocess.PIPE,
            "stderr": self._errors,
            "text": True,
        }
        self._worker = subprocess.Popen(command, cwd=ROOT, env=environment, **pipes)
        assert self._worker.stdin and self._worker.stdout
        self._orders: IO[str] = self._worker.stdin
        self._answers: IO[str] = self._worker.stdout

    def begin(self) -> None:
        self._send(
            {
                "setting": self.entry.setting.to_dict(),
                "genomes": self.entry.genomes,
                "cores": self.entry.cores,
            }
        )

    def measure(self, fill: float) -> dict[str, Any]:
        """Return a measurement; raise RuntimeError with the last error of a failed worker."""
        self._send({"fill": fill})
        line = self._answers.readline()
        if not line:
            self._worker.wait()
            self._errors.seek(0)
            lines = self._errors.read().strip().splitlines()
            raise RuntimeError(lines[-1] if lines else "the process ended without a message")
        answer: dict[str, Any] = json.loads(line)
        return answer

    def _send(self, order: dict[str, Any]) -> None:
        try:
            self._orders.write(json.dumps(order) + "\n")
            self._orders.flush()
        except BrokenPipeError:
            pass  # `measure` then reports the errors of the worker

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._worker.kill()
        self._worker.wait()


def race(entries: Sequence[Entry], rounds: int) -> list[Record]:
    """Measure entries in turns, and return one record per entry."""
    with ExitStack() as running:
        started = [_start(entry, running) for entry in entries]
        eaten: list[list[float]] = [
            [record.eaten] if record.eaten is not None else [] for _, record in started
        ]
        for _ in range(rounds):
            for (process, record), meals in zip(started, eaten, strict=True):
                if not record.not_measured:
                    answer = process.measure(MIN_MEASUREMENT_SECONDS)
                    record.rates.append(answer["agent_steps"] / answer["seconds"])
                    record.peak_mib = answer["peak_mib"]
                    meals += [answer["eaten"]] if answer["eaten"] is not None else []
    for (_, record), meals in zip(started, eaten, strict=True):
        record.eaten = sum(meals) / len(meals) if meals else None
    return [record for _, record in started]


def _start(entry: Entry, running: ExitStack) -> tuple[Process, Record]:
    record = Record(entry.contender, entry.setting.name, entry.cores)
    began = time.perf_counter()
    process = running.enter_context(Process(entry))
    process.begin()
    try:
        answer = process.measure(0)
    except RuntimeError as error:
        record.not_measured = str(error)
        return process, record
    record.first_seconds = time.perf_counter() - began
    record.agent_steps_of_call = answer["agent_steps"]
    record.peak_mib = answer["peak_mib"]
    record.eaten = answer["eaten"]
    return process, record
