"""Tests that the lanes of a SIMD block have the bits of single lanes."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from baldwinlab.engine.jit import cached_jit, compiled
from baldwinlab.engine.simd import (
    WIDTH,
    any_of,
    choose,
    clamp,
    get,
    lookup,
    negated,
    put,
    simd_block,
    square_root,
)

ROWS = 19


@compiled
def _work(out: Any, a: Any, b: Any, half: Any, lane: Any) -> None:
    x, y, s = get(a, 0, lane), get(b, 0, lane), half[0]
    put(out, 0, lane, x + y)
    put(out, 1, lane, x - y)
    put(out, 2, lane, x * y)
    put(out, 3, lane, x / y)
    put(out, 4, lane, s - x)
    put(out, 5, lane, x - s)
    put(out, 6, lane, s / x)
    put(out, 7, lane, clamp(x, s))
    put(out, 8, lane, choose(x < y, x, s))
    put(out, 9, lane, choose((x <= y) & negated(x > s), s, y))
    put(out, 10, lane, choose((x >= y) | (s < x), s, y))
    put(out, 11, lane, abs(x))
    put(out, 12, lane, square_root(abs(x)))
    put(out, 13, lane, s)
    put(out, 14, lane, lookup(half, abs(clamp(x, s)) + abs(clamp(y, s))))
    put(out, 15, lane, choose(x > y, s, s))
    put(out, 16, lane, -x)


def _sixteen(out: Any, a: Any, b: Any, half: Any, first: int) -> None:
    lane = simd_block(first)
    _work(out, a, b, half, lane)
    out[17, first] = any_of(get(a, 0, lane) > get(b, 0, lane))
    out[18, first] = any_of(get(a, 0, lane) > get(a, 0, lane))


def _one_by_one(out: Any, a: Any, b: Any, half: Any, first: int) -> None:
    for lane in range(first, first + WIDTH):
        _work(out, a, b, half, lane)


@pytest.fixture(scope="module")
def values() -> tuple[Any, ...]:
    random = np.random.default_rng(0)
    a, b = random.normal(size=(2, 1, 3 * WIDTH)).astype(np.float32)
    return a, b, np.array([0.5, 7.0], np.float32)


def _done(work: Callable[..., Any], values: tuple[Any, ...]) -> Any:
    out = np.zeros((ROWS, 3 * WIDTH), np.float32)
    work(out, *values, WIDTH)
    return out


def test_sixteen_lanes_in_a_bundle_have_the_bits_of_each_by_itself(values: tuple[Any, ...]) -> None:
    together, alone, python = (
        _done(work, values) for work in (cached_jit(_sixteen), cached_jit(_one_by_one), _one_by_one)
    )
    assert np.array_equal(together[:17], alone[:17])
    assert np.array_equal(alone, python)
    assert alone[:17, WIDTH : 2 * WIDTH].all()
    assert not together[:, :WIDTH].any() and not together[:, 2 * WIDTH :].any(), (
        "it reached beyond its lanes"
    )


def test_a_mask_is_true_anywhere_or_nowhere(values: tuple[Any, ...]) -> None:
    together = _done(cached_jit(_sixteen), values)
    assert together[17, WIDTH] == 1
    assert together[18, WIDTH] == 0


@compiled
def _write_minus(out: Any, a: Any, lane: Any) -> None:
    for row in range(a.shape[0]):
        put(out, row, lane, -get(a, row, lane))


def _negate_block(out: Any, a: Any) -> None:
    _write_minus(out, a, simd_block(0))


def _negate_lanes(out: Any, a: Any) -> None:
    for lane in range(WIDTH):
        _write_minus(out, a, lane)


def test_unary_minus_has_the_bits_of_numpy_also_for_zeros_infinities_and_subnormal_numbers() -> (
    None
):
    special = np.array([0.0, -0.0, np.inf, -np.inf, 1e-45, -1e-45, 3.4e38, 1.5], np.float32)
    a = np.repeat(special[:, None], WIDTH, axis=1)
    assert np.signbit(np.negative(special))[:2].tolist() == [True, False]
    for negate in (cached_jit(_negate_block), cached_jit(_negate_lanes), _negate_lanes):
        out = np.full_like(a, np.nan)
        negate(out, a)
        assert out.tobytes() == np.negative(a).tobytes()
