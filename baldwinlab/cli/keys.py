"""Keys that a user presses in a terminal, without the Enter key."""

from __future__ import annotations

import os
import select
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final

ESCAPE: Final = b"\x1b"
# The sequences that terminals send for the arrow keys.
ARROW_KEYS: Final = {"\x1b[D": "left", "\x1b[C": "right"}


@contextmanager
def read_keys() -> Iterator[Callable[[float], str]]:
    """Read single keys until the block ends.

    Yields
    ------
    Callable
        Waits at most the given number of seconds, and returns a character, "left", "right", or ""
        if no key was pressed. Without a terminal for input, or on Windows, it only waits.
    """
    if sys.platform == "win32" or not sys.stdin.isatty():
        yield _wait
        return
    # These modules exist on POSIX systems only.
    import termios
    import tty

    descriptor = sys.stdin.fileno()
    settings = termios.tcgetattr(descriptor)
    tty.setcbreak(descriptor)
    try:
        yield _read_key
    finally:
        termios.tcsetattr(descriptor, termios.TCSADRAIN, settings)


def _wait(seconds: float) -> str:
    time.sleep(seconds)
    return ""


def _read_key(seconds: float) -> str:
    descriptor = sys.stdin.fileno()
    is_pressed, _, _ = select.select([descriptor], [], [], seconds)
    if not is_pressed:
        return ""
    sequence = os.read(descriptor, 1)
    # The Escape key alone sends no further bytes.
    if sequence == ESCAPE and select.select([descriptor], [], [], 0)[0]:
        sequence += os.read(descriptor, 2)
    text = sequence.decode("utf-8", "replace")
    return ARROW_KEYS.get(text, text[0])
