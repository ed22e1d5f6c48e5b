"""A function that returns free memory to the operating system."""

from __future__ import annotations

import ctypes
import sys


def release_memory() -> None:
    """Return free memory to the operating system.

    On Linux, the allocator of the C library does not return freed small blocks by itself.
    """
    if sys.platform == "linux":
        # Not every C library has malloc_trim.
        trim = getattr(ctypes.CDLL(None), "malloc_trim", lambda bytes_to_keep: None)
        trim(0)
