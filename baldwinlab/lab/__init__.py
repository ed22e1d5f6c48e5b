"""The lab: a local server and a web page that show, run, replay and share studies.

The package `server` needs the extra `lab`. The packages `sources` and `pages` work without it.
`server/routes.py` names the function of each request. Such a function gets a `Lab` and a query, and
reads the values of the query with the functions of this module. Errors name the parameter.
"""

from __future__ import annotations

import ctypes
import json
import math
import sys
from asyncio import Semaphore
from collections import OrderedDict
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Any, Final

from baldwinlab.studies.records import StudyError

if TYPE_CHECKING:
    from baldwinlab.lab.sources.live import Live

MAX_QUEUED_RESPONSES = 4
MAX_CACHE_BYTES = 128 * 2**20
# The parameters of a request, by name.
Query = Mapping[str, str]
# A number with more digits is rejected before Python parses the text.
MAX_DIGITS: Final = 11


class MissingError(StudyError):
    """A requested study, condition, run or other object does not exist (HTTP status 404)."""


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
            # The lock is free during `make`, so another thread may have stored this entry.
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


@dataclass(frozen=True)
class Lab:
    """The state that all routes of one server share."""

    root: Path  # The served folder, as a resolved path. All served studies are in it.
    live: Live
    # Recordings and other results that take time to compute.
    cache: Cache = field(default_factory=Cache)
    # The finished fraction of each movie, by a ticket: an id that the page has chosen.
    movie_progress: dict[str, float] = field(default_factory=dict)
    # Limits the number of large responses in memory.
    response_slots: Semaphore = field(default_factory=lambda: Semaphore(MAX_QUEUED_RESPONSES))
    # Returns whether the engine is compiled. Until then, pages do not simulate.
    is_engine_ready: Callable[[], bool] = lambda: True
    # The command that started this lab. Messages show it with additional options.
    command: Sequence[str] = ("baldwinlab", "lab")


def release_memory() -> None:
    """Return free memory to the operating system.

    On Linux, the allocator of the C library does not return freed small blocks by itself.
    """
    if sys.platform == "linux":
        # Not every C library has malloc_trim. 0: keep no free bytes.
        trim = getattr(ctypes.CDLL(None), "malloc_trim", lambda bytes_to_keep: None)
        trim(0)


def read_text(query: Query, name: str) -> str:
    """Return a parameter. Raise ValueError if it is missing."""
    if name not in query:
        raise ValueError(f"{name} is missing from the request")
    return query[name]


def read_number(query: Query, name: str, default: int | None = None) -> int:
    """Return a parameter as a whole number of at least 0. Raise ValueError for another value."""
    if default is not None and name not in query:
        return default
    value = read_text(query, name)
    is_whole_number = value.isascii() and value.isdecimal() and len(value) <= MAX_DIGITS
    if not is_whole_number:
        raise ValueError(f"{name} = {value!r} must be a whole number of at least 0")
    return int(value)


def read_real(query: Query, name: str, default: float) -> float:
    """Return a parameter as a finite number. Raise ValueError for another value."""
    text = query.get(name, str(default))
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ValueError(f"{name} = {text!r} must be a finite number")
    return value


def read_body_number(body: Mapping[str, Any], name: str, default: int) -> int:
    """Return a whole number from a JSON body. Raise ValueError for another value."""
    value = body.get(name, default)
    # In Python, True and False are integers.
    if isinstance(value, bool) or not isinstance(value, int):
        raise ValueError(f"{name} = {value!r} must be a whole number")
    return value
