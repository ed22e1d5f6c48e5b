"""Tests of the cache, whose size in bytes is limited."""

from __future__ import annotations

from functools import partial

import pytest

from baldwinlab.lab import Cache


def fail() -> bytes:
    raise AssertionError("the value is not in the cache")


def test_a_value_is_computed_once() -> None:
    cache = Cache(100)
    assert cache.get("a", lambda: b"made") == b"made"
    assert cache.get("a", fail) == b"made"


def test_the_least_recently_used_value_is_removed() -> None:
    cache = Cache(100)
    for key in "ab":
        cache.get(key, lambda: bytes(50))
    cache.get("a", fail)
    cache.get("c", lambda: bytes(50))
    assert cache.used_bytes == 100
    cache.get("a", fail)
    with pytest.raises(AssertionError):
        cache.get("b", fail)


def test_the_cache_never_exceeds_its_limit() -> None:
    cache = Cache(1000)
    for key in range(500):
        assert len(cache.get(key, partial(bytes, key))) == key
        assert cache.used_bytes <= 1000
    assert len(cache.get("large", lambda: bytes(1001))) == 1001
    assert 0 < cache.used_bytes <= 1000


def test_a_value_that_two_threads_compute_counts_once() -> None:
    cache = Cache(100)
    cache.get("a", lambda: cache.get("a", lambda: bytes(10)))
    assert cache.used_bytes == 10
