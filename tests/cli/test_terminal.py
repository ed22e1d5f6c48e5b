"""A command in a pseudo-terminal: the curve of a run grows there, and plain output has no curve."""

from __future__ import annotations

import fcntl
import os
import pty
import re
import select
import struct
import subprocess
import sys
import termios
import time
from pathlib import Path

from baldwinlab.core.console import BARS
from tests.commands import Command

RUN = (
    *("run", "evo+self-taught/A", "--runs", "2", "--workers", "1"),
    *("--set", "evolution.generations=5", "lifetime.steps=500"),
)
# Seconds until a test that hangs fails.
TIMEOUT = 300
ROWS = 40
COLUMNS = 100


def run_in_terminal(folder: Path, *arguments: str) -> str:
    """Run a command in a pseudo-terminal, and return its output."""
    controller, terminal = pty.openpty()
    size = struct.pack("HHHH", ROWS, COLUMNS, 0, 0)
    fcntl.ioctl(terminal, termios.TIOCSWINSZ, size)
    process = subprocess.Popen(
        [sys.executable, "-m", "baldwinlab", *arguments],
        cwd=folder,
        stdin=terminal,
        stdout=terminal,
        stderr=terminal,
        env=os.environ | {"TERM": "xterm-256color", "COLUMNS": str(COLUMNS), "LINES": str(ROWS)},
        start_new_session=True,
    )
    try:
        output = ""
        end = time.monotonic() + TIMEOUT
        while process.poll() is None and time.monotonic() < end:
            output += read_available(controller)
        assert process.wait(timeout=TIMEOUT) == 0
        return output + read_available(controller)
    finally:
        process.kill()
        process.wait()
        os.close(controller)
        os.close(terminal)


def read_available(descriptor: int) -> str:
    """Return the characters that a terminal has printed since the last call."""
    is_readable, _, _ = select.select([descriptor], [], [], 0.05)
    return os.read(descriptor, 65536).decode("utf-8", "replace") if is_readable else ""


def test_the_curve_of_the_outcome_grows_in_a_terminal_only(
    command: Command, tmp_path: Path
) -> None:
    output = run_in_terminal(tmp_path, *RUN, "--out", "mine")
    assert re.search(rf"evo\+self-taught/A [{BARS}]+ \d", output)
    plain = command(*RUN, "--out", "plain")
    assert plain.code == 0 and "plain" in plain.out
    assert not set(plain.out + plain.err) & set(f"{BARS}\x1b\r")
