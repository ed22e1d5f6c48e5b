"""The serial share, the predicted speed-up, and the time outside of compiled functions."""

from __future__ import annotations

import time
from typing import Any

import pytest

from baldwinlab.engine.numba_internals import dispatchers
from benchmarks.lock import Clock, Times
from benchmarks.scaling import Work, format_work, measure, predict_speedup


def test_the_serial_share_limits_the_speedup() -> None:
    assert predict_speedup(0.0, 16) == pytest.approx(16)
    assert predict_speedup(1.0, 16) == pytest.approx(1)
    # A tenth of the work is serial: 0.1 + 0.9 / 9 = 0.2 of the time.
    assert predict_speedup(0.1, 9) == pytest.approx(5)
    assert predict_speedup(0.1, 10**9) == pytest.approx(10)


def test_a_table_has_measured_and_predicted_speedups() -> None:
    single = Times(elapsed=10.0, cpu=8.0, compiled=6.0)
    double = Times(elapsed=6.25, cpu=8.5, compiled=0.0)
    measured = {
        1: {"command": single, "session": single},
        2: {"command": double, "session": double},
    }
    title, sentences, table = format_work(Work("study", [], 1), measured).split("\n\n")
    assert title == "**study**"
    assert "Serial share of the complete command: 25.0%, 2.00 of 8.00 s" in sentences
    header, _, seconds, speedup, predicted, *_ = table.splitlines()
    assert header == "| workers | 1 | 2 | 4 | 8 | 16 | 64 |"
    assert seconds == "| complete command: elapsed s | 10.00 | 6.25 |  |  |  |  |"
    assert speedup == "| complete command: speed-up | 1.00 | 1.60 |  |  |  |  |"
    assert predicted.startswith("| complete command: predicted speed-up | 1.00 | 1.60 | 2.29 |")


def test_a_clock_separates_compiled_functions_from_python(monkeypatch: pytest.MonkeyPatch) -> None:
    cpu = 0.0

    def compute(seconds: float) -> float:
        nonlocal cpu
        cpu += seconds
        return seconds

    def find(dispatcher: Any, types: Any) -> Any:
        compute(1.0)
        return compute

    monkeypatch.setattr(dispatchers, "find_compiled_function", find)
    monkeypatch.setattr(time, "thread_time", lambda: cpu)
    monkeypatch.setattr(time, "process_time", lambda: cpu)
    clock = Clock()
    start = clock.read()
    function = dispatchers.find_compiled_function(None, ())
    assert function(6.0) == 6.0
    compute(3.0)
    times = clock.read() - start
    assert (times.cpu, times.compiled, times.under_lock) == (10.0, 6.0, 4.0)
    assert times.serial_share == pytest.approx(0.4)


def test_the_times_of_a_command_include_its_simulation() -> None:
    settings = ["evo/A", "--set", "evolution.generations=2", "lifetime.steps=20"]
    times = measure(Work("two runs", settings, runs=2), workers=1)
    command, session = times["command"], times["session"]
    assert 0 < session.compiled < session.cpu < command.cpu
    assert session.elapsed < command.elapsed
