"""Memory that nobody holds any longer."""

from __future__ import annotations

import ctypes
import sys


def give_back() -> None:
    """Hand it back to the system: what was allocated in many pieces, C's allocator on Linux keeps unless it is told."""
    if sys.platform == "linux":
        trim = getattr(
            ctypes.CDLL(None), "malloc_trim", lambda left: None
        )  # not every C library has it
        trim(0)
