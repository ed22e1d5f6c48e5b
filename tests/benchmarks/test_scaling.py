"""The serial share, the predicted speed-up, and the time under the lock of the interpreter."""

from __future__ import annotations

import hashlib
import os
import time
from typing import Any

import pytest

from baldwinlab.engine.numba_internals import dispatchers
from benchmarks.lock import Clock, Times
from benchmarks.scaling import PARTS, Work, format_work, measure, predict_speedup


def test_the_time_under_the_lock_limits_the_speedup() -> None:
    parallel = Times(elapsed=0, cpu=10, released=10)
    serial = Times(elapsed=0, cpu=10, released=0)
    # A tenth of the work is serial: 1 + 9 / 9 = 2 of 10 seconds.
    mixed = Times(elapsed=0, cpu=10, released=9)
    assert predict_speedup(parallel, parallel, 16) == pytest.approx(16)
    assert predict_speedup(serial, serial, 16) == pytest.approx(1)
    assert predict_speedup(mixed, mixed, 9) == pytest.approx(5)
    assert predict_speedup(mixed, mixed, 10**9) == pytest.approx(10)
    # Smaller tasks have the same compiled work, and three times the time under the lock.
    assert predict_speedup(mixed, Times(elapsed=0, cpu=12, released=9), 9) == pytest.approx(2.5)


def test_a_table_has_measured_and_predicted_speedups() -> None:
    single = Times(elapsed=10.0, cpu=8.0, released=6.0)
    double = Times(elapsed=6.25, cpu=8.5, released=0.0)
    tasks = Times(elapsed=11.0, cpu=10.0, released=6.0)
    measured = {1: dict.fromkeys(PARTS, single), 2: dict.fromkeys(PARTS, double)}
    text = format_work(Work("study", [], 1), measured, dict.fromkeys(PARTS, tasks))
    title, sentences, table = text.split("\n\n")
    assert title == "**study**"
    start = "Serial share of the complete command with --workers"
    assert f"{start} 1: 25.0%, 2.00 of 8.00 s" in sentences
    assert f"{start} 16: 40.0%, 4.00 of 10.00 s" in sentences
    header, _, *rows = table.splitlines()
    assert header == "| workers | 1 | 2 | 4 | 8 | 16 | 64 |"
    start = "| complete command:"
    assert rows[0] == f"{start} elapsed s | 10.00 | 6.25 |  |  |  |  |"
    assert rows[1] == f"{start} speed-up | 1.00 | 1.60 |  |  |  |  |"
    assert rows[2].startswith(f"{start} predicted speed-up | 1.00 | 1.60 | 2.29 |")
    assert rows[3].startswith(f"{start} predicted, tasks of --workers 16 | 0.80 | 1.14 | 1.45 |")


def test_a_clock_separates_functions_that_release_the_lock_from_others(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    cpu = 0.0

    def compute(seconds: float) -> float:
        nonlocal cpu
        cpu += seconds
        return seconds

    def find(dispatcher: Any, types: Any) -> Any:
        compute(1.0)
        return compute

    monkeypatch.setattr(dispatchers, "find_compiled_function", find)
    # The clock replaces these functions, and the test restores them.
    monkeypatch.setattr(hashlib, "sha256", lambda content: compute(2.0))
    monkeypatch.setattr(os, "fsync", lambda file: compute(0.5))
    monkeypatch.setattr(time, "thread_time", lambda: cpu)
    monkeypatch.setattr(time, "process_time", lambda: cpu)
    clock = Clock()
    start = clock.read()
    function = dispatchers.find_compiled_function(None, ())
    assert function(6.0) == 6.0
    compute(3.0)
    hashlib.sha256(b"")
    os.fsync(0)
    times = clock.read() - start
    assert (times.cpu, times.released, times.under_lock) == (12.5, 8.5, 4.0)
    assert times.serial_share == pytest.approx(0.32)


def test_the_times_of_a_command_include_its_simulation() -> None:
    settings = ["evo/A", "--set", "evolution.generations=2", "lifetime.steps=20"]
    times = measure(Work("two runs", settings, runs=2), workers=2, threads=1)
    command, session = times["command"], times["session"]
    assert 0 < session.released < session.cpu < command.cpu
    assert session.elapsed < command.elapsed
