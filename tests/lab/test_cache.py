"""Memory that is bounded in bytes."""

from __future__ import annotations

from functools import partial

import pytest

from baldwinlab.lab.cache import Cache


def never() -> bytes:
    raise AssertionError("it should have been kept")


def test_what_was_made_is_made_once() -> None:
    cache = Cache(100)
    assert cache.get("a", lambda: b"made") == b"made"
    assert cache.get("a", never) == b"made"


def test_what_was_asked_for_least_recently_gives_way() -> None:
    cache = Cache(100)
    for key in "ab":
        cache.get(key, lambda: bytes(50))
    cache.get("a", never)
    cache.get("c", lambda: bytes(50))
    assert cache.size == 100
    cache.get("a", never)
    with pytest.raises(AssertionError):
        cache.get("b", never)


def test_it_never_holds_more_than_its_limit() -> None:
    cache = Cache(1000)
    for key in range(500):
        assert len(cache.get(key, partial(bytes, key))) == key
        assert cache.size <= 1000
    assert len(cache.get("large", lambda: bytes(1001))) == 1001
    assert 0 < cache.size <= 1000


def test_what_two_make_at_once_counts_once() -> None:
    cache = Cache(100)
    cache.get("a", lambda: cache.get("a", lambda: bytes(10)))
    assert cache.size == 10
