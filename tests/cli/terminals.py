"""Commands in a pseudo-terminal, for several test files."""

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
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

# Seconds until a test that hangs fails.
TIMEOUT = 300
ROWS = 40
COLUMNS = 100


class Terminal:
    """A command in a pseudo-terminal. `output` is all that it has printed."""

    def __init__(self, process: subprocess.Popen[bytes], descriptor: int) -> None:
        self.process = process
        self._descriptor = descriptor
        self.output = ""

    def press(self, keys: str) -> None:
        os.write(self._descriptor, keys.encode())

    def wait_for(self, pattern: str) -> re.Match[str]:
        """Wait until the output after the last match has a pattern, and forget what precedes it."""
        end = time.monotonic() + TIMEOUT
        unread = ""
        while time.monotonic() < end:
            unread += self._read()
            if match := re.search(pattern, unread):
                return match
        raise AssertionError(f"{pattern!r} did not appear in {unread[-500:]!r}")

    def wait_for_end(self) -> int:
        """Read the output until the command ends, and return its exit status."""
        end = time.monotonic() + TIMEOUT
        while self.process.poll() is None and time.monotonic() < end:
            self._read()
        self._read()
        return self.process.wait(timeout=TIMEOUT)

    @property
    def is_echoing(self) -> bool:
        """Whether the terminal shows typed characters."""
        return bool(termios.tcgetattr(self._descriptor)[3] & termios.ECHO)

    def _read(self) -> str:
        is_readable, _, _ = select.select([self._descriptor], [], [], 0.05)
        if not is_readable:
            return ""
        try:
            text = os.read(self._descriptor, 65536).decode("utf-8", "replace")
        except OSError:
            # The command has ended.
            return ""
        self.output += text
        return text


@contextmanager
def run_in_terminal(folder: Path, *arguments: str) -> Iterator[Terminal]:
    """Run a command in a pseudo-terminal, and end it with the block."""
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
        yield Terminal(process, controller)
    finally:
        process.kill()
        process.wait()
        os.close(controller)
        os.close(terminal)
