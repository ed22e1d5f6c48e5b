"""Test that the lanes of a SIMD block have the bits of single lanes."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from baldwinlab.engine.arithmetic import sigmoid
from baldwinlab.engine.jit import cached_jit, compiled
from baldwinlab.engine.simd import (
    WIDTH,
    any_of,
    choose,
    clamp,
    fill_lanes,
    get,
    lookup,
    negated,
    put,
    simd_block,
    square_root,
)

ROWS = 19


@compiled
def _calculate(out: Any, a: Any, b: Any, half: Any, lane: Any) -> None:
    x = get(a, 0, lane)
    y = get(b, 0, lane)
    s = half[0]
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
    put(out, 10, lane, choose((x >= y) | (s < x), fill_lanes(lane, s), y))
    put(out, 11, lane, abs(x))
    put(out, 12, lane, square_root(abs(x)))
    put(out, 13, lane, s)
    put(out, 14, lane, lookup(half, abs(clamp(x, s)) + abs(clamp(y, s))))
    put(out, 15, lane, choose(x > y, s, s))
    put(out, 16, lane, -x)


def _calculate_block(out: Any, a: Any, b: Any, half: Any, first: int) -> None:
    lane = simd_block(first)
    _calculate(out, a, b, half, lane)
    out[17, first] = any_of(get(a, 0, lane) > get(b, 0, lane))
    out[18, first] = any_of(get(a, 0, lane) > get(a, 0, lane))


def _calculate_lanes(out: Any, a: Any, b: Any, half: Any, first: int) -> None:
    for lane in range(first, first + WIDTH):
        _calculate(out, a, b, half, lane)


@pytest.fixture(scope="module")
def values() -> tuple[Any, ...]:
    random = np.random.default_rng(0)
    a, b = random.normal(size=(2, 1, 3 * WIDTH)).astype(np.float32)
    return a, b, np.array([0.5, 7.0], np.float32)


def _run(function: Callable[..., Any], values: tuple[Any, ...]) -> Any:
    out = np.zeros((ROWS, 3 * WIDTH), np.float32)
    function(out, *values, WIDTH)
    return out


def test_the_lanes_of_a_block_have_the_bits_of_single_lanes(values: tuple[Any, ...]) -> None:
    block = _run(cached_jit(_calculate_block), values)
    lanes = _run(cached_jit(_calculate_lanes), values)
    python = _run(_calculate_lanes, values)
    assert np.array_equal(block[:17], lanes[:17])
    assert np.array_equal(lanes, python)
    assert lanes[:17, WIDTH : 2 * WIDTH].all()
    assert not block[:, :WIDTH].any(), "the block wrote to lanes before its own"
    assert not block[:, 2 * WIDTH :].any(), "the block wrote to lanes after its own"


def test_any_of_is_true_if_a_lane_of_the_mask_is_true(values: tuple[Any, ...]) -> None:
    block = _run(cached_jit(_calculate_block), values)
    assert block[17, WIDTH] == 1
    assert block[18, WIDTH] == 0


@compiled
def _write_negative(out: Any, a: Any, lane: Any) -> None:
    for row in range(a.shape[0]):
        put(out, row, lane, -get(a, row, lane))


def _negate_block(out: Any, a: Any) -> None:
    _write_negative(out, a, simd_block(0))


def _negate_lanes(out: Any, a: Any) -> None:
    for lane in range(WIDTH):
        _write_negative(out, a, lane)


def test_unary_minus_has_the_bits_of_numpy_for_special_numbers() -> None:
    special = np.array([0.0, -0.0, np.inf, -np.inf, 1e-45, -1e-45, 3.4e38, 1.5], np.float32)
    a = np.repeat(special[:, None], WIDTH, axis=1)
    assert np.signbit(np.negative(special))[:2].tolist() == [True, False]
    for negate in (cached_jit(_negate_block), cached_jit(_negate_lanes), _negate_lanes):
        out = np.full_like(a, np.nan)
        negate(out, a)
        assert out.tobytes() == np.negative(a).tobytes()


@compiled
def _write_clamped(out: Any, a: Any, limit: Any, lane: Any) -> None:
    put(out, 0, lane, clamp(get(a, 0, lane), limit[0]))
    put(out, 1, lane, sigmoid(get(a, 0, lane)))


def _clamp_block(out: Any, a: Any, limit: Any) -> None:
    _write_clamped(out, a, limit, simd_block(0))


def _clamp_lanes(out: Any, a: Any, limit: Any) -> None:
    for lane in range(WIDTH):
        _write_clamped(out, a, limit, lane)


def test_clamp_and_sigmoid_of_nan_are_nan_in_its_lane_only() -> None:
    a = np.linspace(-3, 3, WIDTH, dtype=np.float32)[None]
    a[0, 1] = np.nan
    limit = np.array([2.0], np.float32)
    expected = np.clip(a[0], -2, 2)
    for clamp_all in (cached_jit(_clamp_block), cached_jit(_clamp_lanes), _clamp_lanes):
        out = np.zeros((2, WIDTH), np.float32)
        clamp_all(out, a, limit)
        assert np.array_equal(out[0], expected, equal_nan=True)
        assert np.flatnonzero(np.isnan(out[1])).tolist() == [1]
