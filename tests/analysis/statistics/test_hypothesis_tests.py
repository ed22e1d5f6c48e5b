"""The sign test against SciPy's binomial test, exact ties, skewed values and simulation."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some
from scipy import stats

from baldwinlab.analysis.statistics.hypothesis_tests import (
    equivalence_p,
    sign_interval,
    sign_tails,
    sign_test,
)


def count_signs(values: np.ndarray, alternative: Literal["two-sided", "less", "greater"]) -> float:
    """Return the p-value of the sign test, by SciPy's binomial test."""
    n_signs = int((values != 0).sum())
    if n_signs == 0:
        return 1.0
    return float(stats.binomtest(int((values > 0).sum()), n_signs, alternative=alternative).pvalue)


@given(some.lists(some.integers(-2, 4).map(float), min_size=1, max_size=30))
def test_p_values_are_those_of_a_binomial_test_without_zeros(values: list[float]) -> None:
    sample = np.array(values)
    p_less, p_greater = sign_tails(sample[None])
    assert p_less[0] == pytest.approx(count_signs(sample, "less"))
    assert p_greater[0] == pytest.approx(count_signs(sample, "greater"))
    assert sign_test(sample[None])[0] == pytest.approx(count_signs(sample, "two-sided"))


def test_several_samples_have_the_p_values_of_single_samples() -> None:
    samples = np.random.default_rng(1).normal(0.3, 1, (5, 12))
    single = [float(sign_test(sample[None])[0]) for sample in samples]
    assert sign_test(samples).tolist() == single


def test_the_p_value_of_equivalence_is_that_of_the_nearer_bound() -> None:
    values = np.random.default_rng(1).normal(0.02, 0.06, 15)
    nearer = count_signs(values - 0.05, "less")
    farther = count_signs(values + 0.05, "greater")
    assert nearer > farther
    assert equivalence_p(values[None], 0.05)[0] == pytest.approx(nearer)


@pytest.mark.parametrize("n_values", [6, 8, 12, 20, 41])
def test_the_interval_has_exactly_the_medians_that_the_test_does_not_reject(n_values: int) -> None:
    values = np.random.default_rng(n_values).normal(0, 1, n_values)
    low, high = sign_interval(values)
    for inside, outside in ((low + 1e-9, low - 1e-9), (high - 1e-9, high + 1e-9)):
        assert (
            sign_test((values - inside)[None])[0] >= 0.05 > sign_test((values - outside)[None])[0]
        )


def test_fewer_than_six_values_have_no_interval() -> None:
    assert all(math.isnan(end) for end in sign_interval(np.arange(5.0)))
    assert sign_interval(np.arange(6.0)) == (0, 5)


def test_an_effect_at_the_bound_is_called_equivalent_in_at_most_five_percent_of_studies() -> None:
    # The values are skewed, and their median is the bound.
    samples = np.random.default_rng(2).exponential(1, (4000, 12)) - np.log(2) + 0.5
    share = np.mean(equivalence_p(samples, 0.5) < 0.05)
    # Four standard errors above 5 %.
    assert 0.005 < share < 0.05 + 4 * np.sqrt(0.05 * 0.95 / 4000)


def test_a_small_effect_is_called_equivalent_with_enough_runs() -> None:
    samples = np.random.default_rng(3).normal(0.0, 1, (200, 40))
    assert np.mean(equivalence_p(samples, 1.0) < 0.05) > 0.95


def permute_signs(values: np.ndarray, generator: np.random.Generator) -> float:
    """Return the p-value of the permutation test of the mean, from 500 combinations of signs."""
    signs = generator.choice([-1.0, 1.0], (500, values.size))
    return float(np.mean(abs(signs @ values) >= abs(values.sum())))


def test_a_permutation_test_of_the_mean_is_significant_too_often_with_skewed_values() -> None:
    generator = np.random.default_rng(5)
    samples = generator.lognormal(0, 1, (400, 20)) - np.exp(0.5)  # The mean is 0.
    p_values = [permute_signs(sample, generator) for sample in samples]
    assert np.mean(np.array(p_values) < 0.05) > 0.08


@pytest.mark.parametrize("n_values", [8, 20, 40])
def test_skewed_values_with_the_median_0_are_significant_in_at_most_five_percent_of_studies(
    n_values: int,
) -> None:
    samples = np.random.default_rng(4).lognormal(0, 1, (4000, n_values)) - 1
    p = sign_test(samples)
    assert np.mean(p < 0.05) < 0.05 + 4 * np.sqrt(0.05 * 0.95 / 4000)
    # The signed-rank test answers for the mean of pairs, which is above 0.
    assert np.mean(stats.wilcoxon(samples, axis=1).pvalue < 0.05) > 1.5 * np.mean(p < 0.05)
