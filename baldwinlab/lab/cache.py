"""A cache of bytes with bounded memory."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from threading import Lock

LIMIT = 128 * 2**20  # bytes


class Cache:
    """Bytes by key, at most `limit` bytes in total. Drops the least recently used entries first."""

    def __init__(self, limit: int = LIMIT) -> None:
        self._limit = limit
        self._lock = Lock()
        self._entries: OrderedDict[Hashable, bytes] = OrderedDict()
        self.size = 0  # bytes of all entries

    def get(self, key: Hashable, make: Callable[[], bytes]) -> bytes:
        """Return the entry of a key, or the result of `make`.

        A new result is stored unless it alone is larger than the limit.
        """
        with self._lock:
            if key in self._entries:
                self._entries.move_to_end(key)
                return self._entries[key]
        content = make()
        with self._lock:
            # Another thread may have stored it in the meantime.
            if key not in self._entries and len(content) <= self._limit:
                self._entries[key] = content
                self.size += len(content)
            while self.size > self._limit:
                self.size -= len(self._entries.popitem(last=False)[1])
        return content
