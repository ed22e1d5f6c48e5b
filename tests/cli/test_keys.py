"""Tests of commands in a pseudo-terminal: keys, the growing curve, and plain output otherwise."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from baldwinlab.cli.watch import KEYS, SKIPPED_FRAMES
from baldwinlab.core.sparkline import BARS
from tests.cli.terminals import Terminal, run_in_terminal
from tests.commands import Command
from tests.small_studies import make_small_study

RUN = (
    *("run", "evo+self-taught/A", "--runs", "2", "--workers", "1"),
    *("--set", "evolution.generations=5", "lifetime.steps=500"),
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("terminal")
    make_small_study(folder / "small", runs=1)
    return folder


def read_step(terminal: Terminal) -> int:
    """Return the step of the next frame."""
    return int(terminal.wait_for(r"step (\d+) of 300")[1])


def read_step_after(terminal: Terminal, key: str) -> int:
    """Press a key, and return the step when the picture no longer changes."""
    terminal.press(key)
    steps = [read_step(terminal)]
    while len(steps) < 3 or steps[-1] != steps[-3]:
        steps.append(read_step(terminal))
    return steps[-1]


def test_keys_pause_move_and_quit(folder: Path) -> None:
    with run_in_terminal(folder, "watch", "small", "--generation", "1") as terminal:
        terminal.wait_for(re.escape(KEYS))
        assert not terminal.is_echoing
        paused = read_step_after(terminal, " ")
        assert paused < 300
        forward = read_step_after(terminal, "\x1b[C")
        assert forward - paused == SKIPPED_FRAMES
        assert read_step_after(terminal, "\x1b[D") == paused
        # Twice the speed: an arrow skips twice as many steps.
        terminal.press("+")
        assert read_step_after(terminal, "\x1b[C") - paused == 2 * SKIPPED_FRAMES
        terminal.press("q")
        assert terminal.wait_for_end() == 0
        assert terminal.is_echoing
    last_line = terminal.output.splitlines()[-1]
    assert f"generation 1; step {paused + 2 * SKIPPED_FRAMES} of 300: " in last_line


def test_the_curve_of_the_outcome_grows_in_a_terminal_only(
    command: Command, tmp_path: Path
) -> None:
    with run_in_terminal(tmp_path, *RUN, "--out", "mine") as terminal:
        assert terminal.wait_for_end() == 0
    assert re.search(rf"evo\+self-taught/A [{BARS}]+ \d", terminal.output)
    plain = command(*RUN, "--out", "plain")
    assert plain.code == 0 and "plain" in plain.out
    assert not set(plain.out + plain.err) & set(f"{BARS}\x1b\r")
