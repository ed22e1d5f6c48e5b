"""Return free memory to the operating system."""

from __future__ import annotations

import ctypes
import sys


def release_memory() -> None:
    """Return free memory to the operating system.

    On Linux, the allocator of the C library otherwise keeps freed small blocks.
    """
    if sys.platform == "linux":
        # Not every C library has malloc_trim.
        trim = getattr(ctypes.CDLL(None), "malloc_trim", lambda left: None)
        trim(0)
