"""Contenders side by side: each in a fresh process, started one after another, then measured in turns.

Whatever slows the machine for a while slows all of them, so that ratios within a round are worth more than the rates.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryFile
from types import TracebackType
from typing import IO, Any, Self

from benchmarks.setting import Genomes, Setting

ROOT = Path(__file__).parent.parent
FILL = 0.3  # seconds that a measurement lasts at least
KEEP = {"MALLOC_TRIM_THRESHOLD_": "100000000", "MALLOC_MMAP_THRESHOLD_": "100000000"}
"""Lets glibc keep the memory that is freed; without it NumPy, which frees large arrays all the time, loses up to 40 %."""


@dataclass(frozen=True)
class Entry:
    """Who races, on how many cores, and with what."""

    contender: str
    setting: Setting
    genomes: Genomes = field(repr=False)
    cores: int = 1
    environment: Mapping[str, str] = field(default_factory=dict)


@dataclass
class Record:
    """What was measured of an entry. Rates are agent-steps a second, a value a round."""

    contender: str
    scenario: str
    cores: int
    agent_steps_of_call: int = 0
    rates: list[float] = field(default_factory=list)
    cpu_rates: list[float] = field(default_factory=list)  # the same, a second of CPU time
    first_seconds: float = 0.0  # from the start of the process to its first result
    peak_mib: float = 0.0
    eaten: float | None = None  # items by an agent, mean of all calls that were looked at
    not_measured: str = ""  # why


class Process:
    """A worker, from its start to its end."""

    def __init__(self, entry: Entry) -> None:
        self.entry, self._errors = entry, TemporaryFile("w+", encoding="utf-8")  # noqa: SIM115
        command = [sys.executable, "-m", "benchmarks.worker", entry.contender]
        path = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
        environment = {
            **os.environ,
            **entry.environment,
            **KEEP,
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
        self._tell(
            {
                "setting": self.entry.setting.to_dict(),
                "genomes": self.entry.genomes,
                "cores": self.entry.cores,
            }
        )

    def measure(self, fill: float) -> dict[str, Any]:
        """Raises RuntimeError with the worker's last words when it has failed."""
        self._tell({"fill": fill})
        line = self._answers.readline()
        if not line:
            self._worker.wait()
            self._errors.seek(0)
            raise RuntimeError(
                (self._errors.read().strip().splitlines() or ["the process ended without a word"])[
                    -1
                ]
            )
        answer: dict[str, Any] = json.loads(line)
        return answer

    def _tell(self, order: dict[str, Any]) -> None:
        try:
            self._orders.write(json.dumps(order) + "\n")
            self._orders.flush()
        except BrokenPipeError:
            pass  # `measure` finds no answer, and says why

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
    """One record an entry. With no rounds, only the time to the first result and the memory are measured."""
    with ExitStack() as running:
        started = [_start(entry, running) for entry in entries]
        eaten: list[list[float]] = [
            [record.eaten] if record.eaten is not None else [] for _, record in started
        ]
        for _ in range(rounds):
            for (process, record), meals in zip(started, eaten, strict=True):
                if not record.not_measured:
                    answer = process.measure(FILL)
                    record.rates.append(answer["agent_steps"] / answer["seconds"])
                    record.cpu_rates.append(answer["agent_steps"] / answer["cpu_seconds"])
                    record.peak_mib = answer["peak_mib"]
                    meals += [answer["eaten"]] if answer["eaten"] is not None else []
    for (_, record), meals in zip(started, eaten, strict=True):
        record.eaten = sum(meals) / len(meals) if meals else None
    return [record for _, record in started]


def _start(entry: Entry, running: ExitStack) -> tuple[Process, Record]:
    record, began = Record(entry.contender, entry.setting.name, entry.cores), time.perf_counter()
    process = running.enter_context(Process(entry))
    process.begin()
    try:
        answer = process.measure(0)
    except RuntimeError as error:
        record.not_measured = str(error)
        return process, record
    record.first_seconds = time.perf_counter() - began
    record.agent_steps_of_call, record.peak_mib, record.eaten = (
        answer["agent_steps"],
        answer["peak_mib"],
        answer["eaten"],
    )
    return process, record


def cpu_ratios(ours: Record, theirs: Record) -> list[float]:
    """How many times as much ours did in a second of CPU time, round by round; for two that both work on one core."""
    return [our / their for our, their in zip(ours.cpu_rates, theirs.cpu_rates, strict=True)]
