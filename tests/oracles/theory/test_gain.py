"""Test the law of the gain function against plain weighted means and limits."""

from __future__ import annotations

import numpy as np
import pytest

from tests.oracles.theory.gain import selection_gain


def test_the_gain_is_the_difference_of_the_means_of_parents() -> None:
    generator = np.random.default_rng(1)
    for _ in range(500):
        trait = generator.normal(0, 2, 12)
        innate, learned = generator.uniform(0.1, 5, (2, 12))
        difference = (trait * learned).sum() / learned.sum() - (trait * innate).sum() / innate.sum()
        assert selection_gain(trait, innate, learned) == pytest.approx(difference, abs=1e-12)


def test_the_gain_has_the_sign_of_a_monotone_slope() -> None:
    generator = np.random.default_rng(2)
    for sign in (-1, 1):
        for _ in range(300):
            trait = np.sort(generator.normal(0, 1, 9))
            log_gain = sign * np.sort(generator.normal(0, 1, 9))
            innate = generator.uniform(0.1, 5, 9)
            moved = selection_gain(trait, innate, innate * np.exp(log_gain))
            assert np.sign(moved) == sign


def test_a_constant_gain_has_no_effect() -> None:
    trait, innate = np.random.default_rng(3).uniform(0.1, 2, (2, 30))
    assert selection_gain(trait, innate, 7 * innate) == pytest.approx(0, abs=1e-15)


def test_learning_a_share_moves_a_normal_trait_as_the_larger_width_of_selection() -> None:
    """The response of a normal trait is v / (v + V_L) of its distance."""
    trait = np.linspace(-8, 8, 4001)
    agents = np.exp(-(trait**2) / 2)
    fitness = [np.exp(-((share * (1 - trait)) ** 2) / 8) for share in (1.0, 0.5)]
    moved = selection_gain(trait, agents * fitness[0], agents * fitness[1])
    assert moved == pytest.approx(1 / (1 + 16) - 1 / (1 + 4), abs=1e-9)
