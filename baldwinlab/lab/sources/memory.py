"""The memory of a lab: a bounded cache of bytes, and the release of freed memory."""

from __future__ import annotations

import ctypes
import json
import sys
from collections import OrderedDict
from collections.abc import Callable, Hashable
from threading import Lock
from typing import Any

MAX_CACHE_BYTES = 128 * 2**20


class Cache:
    """Bytes by key, at most `max_bytes` in total.

    A full cache drops its least recently used entries.
    """

    def __init__(self, max_bytes: int = MAX_CACHE_BYTES) -> None:
        self._max_bytes = max_bytes
        self._lock = Lock()
        # The most recently used entry is the last one.
        self._entries: OrderedDict[Hashable, bytes] = OrderedDict()
        self.used_bytes = 0

    def get(self, key: Hashable, make: Callable[[], bytes]) -> bytes:
        """Return the entry of a key, or the result of `make`.

        A new result is stored unless it is larger than `max_bytes`.
        """
        with self._lock:
            if key in self._entries:
                self._entries.move_to_end(key)
                return self._entries[key]
        content = make()
        with self._lock:
            # Another thread may have stored an entry of this key during `make`.
            if key not in self._entries and len(content) <= self._max_bytes:
                self._entries[key] = content
                self.used_bytes += len(content)
            while self.used_bytes > self._max_bytes:
                _, oldest_content = self._entries.popitem(last=False)
                self.used_bytes -= len(oldest_content)
        return content

    def get_json(self, key: Hashable, make: Callable[[], Any]) -> bytes:
        """Return the entry of a key, or the result of `make` as JSON."""
        return self.get(key, lambda: json.dumps(make()).encode())


def release_memory() -> None:
    """Return free memory to the operating system.

    On Linux, the allocator of the C library does not return freed small blocks by itself.
    """
    if sys.platform == "linux":
        # Not every C library has malloc_trim.
        trim = getattr(ctypes.CDLL(None), "malloc_trim", lambda bytes_to_keep: None)
        trim(0)
