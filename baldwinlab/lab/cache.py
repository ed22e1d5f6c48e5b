"""What was asked for last, kept in bounded memory."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from threading import Lock

LIMIT = 128 * 2**20  # bytes


class Cache:
    """Bytes by key, at most `limit` of them in all: those that were asked for least recently give way."""

    def __init__(self, limit: int = LIMIT) -> None:
        self._limit, self._lock = limit, Lock()
        self._kept: OrderedDict[Hashable, bytes] = OrderedDict()
        self.size = 0  # bytes that are kept now

    def get(self, key: Hashable, make: Callable[[], bytes]) -> bytes:
        """What is kept under `key`, or else what `make` makes, which then is kept unless it alone is too large."""
        with self._lock:
            if key in self._kept:
                self._kept.move_to_end(key)
                return self._kept[key]
        made = make()
        with self._lock:
            if (
                key not in self._kept and len(made) <= self._limit
            ):  # another thread may have made it in the meantime
                self._kept[key] = made
                self.size += len(made)
            while self.size > self._limit:
                self.size -= len(self._kept.popitem(last=False)[1])
        return made
