"""Test that Ctrl-C or SIGTERM stops the command line at any time without a traceback."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

START = """
import sys
sys.stderr.write("began\\n")
sys.stderr.flush()
from baldwinlab.__main__ import main
main()
"""

# `check` is called while the command validates its experiment.
SLOW_DESTRUCTOR = """
import sys, time
from baldwinlab.parts import Fitness


class Slow:
    def __del__(self):
        sys.stderr.write("deleting\\n")
        sys.stderr.flush()
        time.sleep(2)


OBJECTS = [Slow()]


class Part(Fitness, name="slow"):
    def check(self, experiment):
        OBJECTS.clear()

    @staticmethod
    def evaluate(part, lifetimes, fitness):
        for agent in range(fitness.size):
            fitness[agent] = 1
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["ctrl-C", "SIGTERM"])
@pytest.mark.parametrize("delay", [0.1, 0.8, 2.0])
def test_a_stopped_command_prints_one_line(
    tmp_path: Path, number: signal.Signals, delay: float
) -> None:
    process = _start_command(tmp_path)
    time.sleep(delay)
    process.send_signal(number)
    _check_stopped(process)


def test_a_signal_stops_a_command_while_a_module_that_catches_all_errors_is_imported(
    tmp_path: Path,
) -> None:
    process = _start_command(tmp_path, "try:\n    time.sleep(2)\nexcept BaseException:\n    pass")
    process.send_signal(signal.SIGTERM)
    _check_stopped(process)


def test_a_second_signal_stops_a_command_during_an_import(tmp_path: Path) -> None:
    process = _start_command(tmp_path, "time.sleep(1000)")
    process.send_signal(signal.SIGTERM)
    time.sleep(0.1)
    process.send_signal(signal.SIGINT)
    _check_stopped(process)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no timers")
def test_a_signal_during_a_destructor_stops_a_command(tmp_path: Path) -> None:
    part = tmp_path / "part.py"
    part.write_text(SLOW_DESTRUCTOR)
    words = ["--part", str(part), "--set", "evolution.fitness=slow"]
    process = _start_process([*_long_command(tmp_path), *words], "deleting")
    process.send_signal(signal.SIGTERM)
    _check_stopped(process)


def _long_command(folder: Path) -> list[str]:
    return ["run", "evo/A", "--runs", "200", "--out", str(folder / "study"), "--workers", "1"]


def _start_command(folder: Path, slow: str = "") -> subprocess.Popen[str]:
    """Start a long command. A part imports a module with the code `slow`, if it is given."""
    words = _long_command(folder)
    if slow:
        (folder / "slow.py").write_text(
            f"import sys, time\nsys.stderr.write('loading\\n')\nsys.stderr.flush()\n{slow}\n"
        )
        (folder / "part.py").write_text(
            f"import sys\nsys.path.insert(0, {str(folder)!r})\nimport slow\nslow.time.sleep(9)\n"
        )
        words += ["--part", str(folder / "part.py")]
    return _start_process(words, *(["loading"] if slow else []))


def _start_process(words: list[str], *messages: str) -> subprocess.Popen[str]:
    """Start a command, and wait for its messages on standard error."""
    process = subprocess.Popen(
        [sys.executable, "-c", START, *words],
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stderr is not None
    for message in ("began", *messages):
        assert process.stderr.readline() == f"{message}\n"
    return process


def _check_stopped(process: subprocess.Popen[str]) -> None:
    out, err = process.communicate(timeout=180)
    assert process.returncode == 130, err
    assert "Traceback" not in err + out
    assert "Interrupted" in err
    assert len(err.strip().splitlines()) == 1
