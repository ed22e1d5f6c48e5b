"""Test the random number generator against published values and its streams for independence."""

from __future__ import annotations

import itertools
import re

import numba
import numpy as np
import numpy.typing as npt
import pytest
from scipy.stats import kstest

from baldwinlab.engine import rng
from baldwinlab.engine.jit import OPTIONS, cached_jit

PURPOSES = (
    rng.BIRTHPLACE,
    rng.FOOD,
    rng.ACTION_WEIGHTS,
    rng.REINFORCEMENT_WEIGHTS,
    rng.SELECTION,
    rng.INHERITANCE,
    rng.MUTATION_GATE,
)


# Source: Random123, kat_vectors, philox4x32 with 10 rounds.
@pytest.mark.parametrize(
    ("counter", "key", "expected"),
    [
        (
            "00000000 00000000 00000000 00000000",
            "00000000 00000000",
            "6627e8d5 e169c58d bc57ac4c 9b00dbd8",
        ),
        (
            "ffffffff ffffffff ffffffff ffffffff",
            "ffffffff ffffffff",
            "408f276d 41c83b0e a20bc7c6 6d5451fd",
        ),
        (
            "243f6a88 85a308d3 13198a2e 03707344",
            "a4093822 299f31d0",
            "d16cfe09 94fdcceb 5001e420 24126ea1",
        ),
    ],
)
def test_philox_gives_the_published_words(counter: str, key: str, expected: str) -> None:
    arguments = [np.uint32(int(word, 16)) for word in (counter + " " + key).split()]
    assert [f"{int(word):08x}" for word in rng.philox(*arguments)] == expected.split()


def test_streams_with_different_keys_have_different_numbers() -> None:
    keys = itertools.product((0, 1, 2**31 - 1), (0, 1, 7), (0, 1, 99), PURPOSES)
    streams = [rng.words(*key, (2, 2)).tobytes() for key in keys]
    assert len(set(PURPOSES)) == len(PURPOSES)
    assert len(set(streams)) == len(streams)
    words = rng.words(1, 2, 3, rng.FOOD, (50, 50))
    # Among 10,000 words of 32 bits, 0.01 pairs are equal by chance.
    assert np.unique(words).size >= words.size - 2


def test_the_numbers_do_not_depend_on_the_size_of_the_draw() -> None:
    np.testing.assert_array_equal(
        rng.words(1, 2, 3, 0, (9, 7))[:4, :2], rng.words(1, 2, 3, 0, (4, 2))
    )


def draw_numbers(out: npt.NDArray[np.float64]) -> None:
    rng.draw_uniforms(1, 2, 3, 4, 5, out)


@pytest.mark.filterwarnings("ignore:overflow:RuntimeWarning")
def test_the_numbers_depend_neither_on_the_order_in_memory_nor_on_vectorization() -> None:
    draw = cached_jit(draw_numbers)
    words = [rng.philox(number, 5, 3, 4, 1, 2) for number in range(40)]
    expected = np.array([[rng.uniform(word) for word in row] for row in words])
    for n_draws in range(len(expected) + 1):
        for out in (np.empty((n_draws, 4)), np.empty((4, n_draws)).T):
            draw(out)
            np.testing.assert_array_equal(out, expected[:n_draws])


def test_several_draws_are_computed_at_once_if_their_numbers_are_adjacent() -> None:
    fresh = numba.njit(no_cfunc_wrapper=True, **OPTIONS)(draw_numbers)
    fresh(np.empty((4, 40)).T)
    (code,) = fresh.inspect_llvm().values()
    # Multiplications of vectors, and not of single numbers.
    assert re.search(r"mul .*<\d+ x i64>", code)


def test_uniform_numbers_are_uniform_in_the_open_interval() -> None:
    draws = rng.uniforms(5, 0, 0, rng.INHERITANCE, (100, 100))
    assert draws.min() > 0
    assert draws.max() < 1
    assert kstest(draws.ravel(), "uniform").pvalue > 0.001
    words = np.array([0, 2**32 - 1], np.uint32)
    assert [float(rng.unit(word)) for word in words] == [0.0, 1 - 2**-24]


def test_neighboring_numbers_are_not_correlated() -> None:
    draws = rng.uniforms(5, 0, 0, rng.INHERITANCE, (100, 100)) - 0.5
    # The limit is five standard errors. A uniform number has the variance 1/12.
    limit = 5 / 12 / np.sqrt(draws.size)
    for axis in range(3):
        products = np.delete(draws, 0, axis) * np.delete(draws, -1, axis)
        assert abs(products.mean()) < limit
