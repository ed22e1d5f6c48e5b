"""Comparisons and their stability against published examples, SciPy and theory."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from scipy import stats

from baldwinlab.analysis.statistics.bootstrap import Sample, median_interval, summarize
from baldwinlab.analysis.statistics.comparisons import (
    compare,
    compare_pairs,
    direction_stability,
    verdict_stability,
)
from baldwinlab.analysis.statistics.hypothesis_tests import holm, mann_whitney, mann_whitney_tests
from baldwinlab.analysis.statistics.significance import PlannedTest, TestMethod

samples = some.lists(some.integers(-5, 5).map(float), min_size=1, max_size=7)


def test_mann_whitney_exact_as_in_hollander_and_wolfe() -> None:
    """Compare with Hollander and Wolfe, Nonparametric Statistical Methods (1973), p. 69.

    The help of wilcox.test in R has the same example.
    """
    at_term = [0.80, 0.83, 1.89, 1.04, 1.45, 1.38, 1.91, 1.64, 0.73, 1.46]
    earlier = [1.15, 0.88, 0.90, 0.74, 1.21]
    comparison = compare(at_term, earlier)
    assert comparison.u == 35
    assert comparison.p == pytest.approx(2 * 0.1272, abs=1e-4)
    assert comparison.a12 == 0.7


def test_mann_whitney_with_ties_as_in_r() -> None:
    """Compare with wilcox.test in R on ozone in May and August (airquality).

    W = 127.5, p = 0.0001208.
    """
    may = np.fromstring(
        "41 36 12 18 28 23 19 8 7 16 11 14 18 14 34 6 30 11 1 11 4 32 23 45 115 37", sep=" "
    )
    august = np.fromstring(
        "39 9 16 78 35 66 122 89 110 44 28 65 22 59 23 31 44 21 9 45 168 73 76 118 84 85", sep=" "
    )
    comparison = compare(may, august)
    assert comparison.u == 127.5
    assert comparison.p == pytest.approx(0.0001208, abs=5e-8)


def test_few_values_with_ties_have_an_exact_p_value() -> None:
    """Of 20 ways to divide 0 0 0 1 2 3 into two samples of three, one is as extreme at each end."""
    assert compare([0, 0, 0], [1, 2, 3]).p == pytest.approx(2 / 20)


@given(samples, samples)
@settings(max_examples=40)
def test_the_comparison_agrees_with_scipy_and_with_counting(a: list[float], b: list[float]) -> None:
    comparison = compare(a, b)
    wins = sum((x > y) + 0.5 * (x == y) for x in a for y in b)
    assert comparison.u == wins == stats.mannwhitneyu(a, b).statistic
    assert comparison.a12 == wins / (len(a) * len(b))
    assert compare(b, a).a12 == pytest.approx(1 - comparison.a12)
    assert compare(b, a).p == pytest.approx(comparison.p)
    assert 0 < comparison.p <= 1


@pytest.mark.parametrize(("d", "a12"), [(0.2, 0.56), (0.5, 0.64), (0.8, 0.71)])
def test_a12_of_normal_samples_is_that_of_vargha_and_delaney(d: float, a12: float) -> None:
    """Compare with table 1 of the paper: Cohen's small, medium and large d as A12."""
    quantiles = stats.norm.ppf((np.arange(400) + 0.5) / 400)
    assert compare(quantiles + d, quantiles).a12 == pytest.approx(a12, abs=0.005)


def test_pairs_as_in_hollander_and_wolfe() -> None:
    """Compare with Hollander and Wolfe, Nonparametric Statistical Methods (1973), p. 29 ff.

    The depression of nine patients before and after a therapy: two of the nine signs are negative.
    """
    first = [1.83, 0.50, 1.62, 2.48, 1.68, 1.88, 1.55, 3.06, 1.30]
    second = [0.878, 0.647, 0.598, 2.05, 1.06, 1.29, 1.06, 3.14, 1.29]
    comparison = compare_pairs(first, second)
    assert comparison.p == pytest.approx(2 * (1 + 9 + 36) / 2**9)
    assert (comparison.n, comparison.above, comparison.below) == (9, 7, 2)
    assert comparison.effect == pytest.approx(0.49)
    # The interval is from the second smallest to the second largest difference.
    assert (comparison.low, comparison.high) == pytest.approx((-0.08, 0.952))


def test_pairs_can_differ_although_samples_do_not() -> None:
    before = np.arange(20.0) * 10
    comparison = compare_pairs(before + 1, before)
    assert comparison.p < 1e-4 and comparison.effect == comparison.low == comparison.high == 1
    assert compare(before + 1, before).p > 0.5


def test_holm_as_computed_by_hand() -> None:
    """0.005 x 4, 0.01 x 3, 0.03 x 2, and 0.04 at least its predecessor; p.adjust in R agrees."""
    np.testing.assert_allclose(holm([0.01, 0.04, 0.03, 0.005]), [0.03, 0.06, 0.06, 0.02])
    np.testing.assert_allclose(holm([0.9, 0.8]), [1, 1])
    assert holm([]).size == 0


@given(some.lists(some.floats(0, 1), min_size=1, max_size=12))
def test_holm_preserves_the_order_and_is_between_p_and_bonferroni(ps: list[float]) -> None:
    corrected = holm(ps)
    assert (corrected >= ps).all() and (
        corrected <= np.minimum(1, np.array(ps) * len(ps) + 1e-12)
    ).all()
    assert (np.diff(corrected[np.argsort(ps, kind="stable")]) >= 0).all()


def test_the_interval_has_its_nominal_coverage() -> None:
    generator = np.random.default_rng(1)
    trials = 150
    hits = 0
    for _ in range(trials):
        comparison = compare(generator.normal(3, 1, 15), generator.normal(2, 1, 15))
        hits += comparison.low <= 1 <= comparison.high
    # The interval of a median is conservative.
    assert hits / trials >= 0.92


def test_the_interval_is_reproducible_and_contains_the_effect() -> None:
    a, b = [1.0, 2, 3, 4, 9], [0.0, 0, 1, 5, 6]
    assert compare(a, b) == compare(a, b)
    assert compare(a, b).low <= compare(a, b).effect == 2 <= compare(a, b).high
    low, high = median_interval(a)
    assert 1 <= low <= 3 <= high <= 9


@pytest.mark.filterwarnings("error")
def test_single_or_equal_values_give_numbers_without_warnings() -> None:
    single = compare([1], [2])
    assert single.p == 1 and math.isnan(single.low) and single.effect == -1
    equal = compare([3, 3, 3], [3, 3, 3])
    assert (equal.p, equal.a12, equal.low, equal.high) == (1, 0.5, 0, 0)
    assert all(math.isnan(bound) for bound in median_interval([4]))
    assert summarize([4]) == (1, 4, 4, 4, 4, 4, 4)
    equal_pairs = compare_pairs([1, 2, 3], [1, 2, 3])
    assert (equal_pairs.p, equal_pairs.effect, equal_pairs.above, equal_pairs.below) == (1, 0, 0, 0)
    single_pair = compare_pairs([3], [1])
    assert single_pair.p == 1 and single_pair.effect == 2 and math.isnan(single_pair.low)
    assert compare_pairs([1, 1, 5, 2], [1, 2, 1, 2]).p == 1
    with pytest.raises(ValueError, match="samples of 1 and 2 are not pairs"):
        compare_pairs([1], [1, 2])


@pytest.mark.parametrize("wrong", [[], [1.0, math.nan], [math.inf]])
@pytest.mark.parametrize(
    "refuse", [lambda wrong: compare(wrong, [1.0]), median_interval, summarize]
)
def test_an_empty_or_non_finite_sample_is_refused(wrong: list[float], refuse: Any) -> None:
    with pytest.raises(ValueError, match="at least one value, and all finite"):
        refuse(wrong)


@settings(max_examples=40)
@given(some.integers(1, 6), some.integers(1, 6), some.data())
def test_tests_of_many_samples_are_those_of_each_sample(
    size_a: int, size_b: int, data: some.DataObject
) -> None:
    values = some.lists(
        some.integers(-3, 3).map(float), min_size=size_a + size_b, max_size=size_a + size_b
    )
    pooled = np.array(data.draw(some.lists(values, min_size=1, max_size=4)))
    a, b = pooled[:, :size_a], pooled[:, size_a:]
    u, p = mann_whitney_tests(a, b, ignores_ties=False)
    expected = [mann_whitney(*samples) for samples in zip(a, b, strict=True)]
    np.testing.assert_allclose(np.stack([u, p], axis=1), expected)


def is_majority_positive(samples: Sample) -> Sequence[str]:
    return ["yes" if positive > 0.5 else "no" for positive in (samples > 0).mean(axis=1)]


def test_stability_is_the_probability_that_a_bootstrap_sample_has_the_same_verdict() -> None:
    values = np.array([1.0] * 9 + [-1.0] * 6)
    expected = stats.binom.sf(7, 15, 9 / 15)
    stability = verdict_stability(values, "yes", is_majority_positive)
    # Four standard errors of 500 samples.
    assert stability == pytest.approx(expected, abs=4 * np.sqrt(expected * (1 - expected) / 500))
    assert stability + verdict_stability(values, "no", is_majority_positive) == pytest.approx(1)


def test_runs_that_agree_have_a_stable_verdict() -> None:
    assert verdict_stability(np.full(8, 2.0), "yes", is_majority_positive) == 1
    # Stability is reproducible.
    values = np.random.default_rng(0).normal(size=20)
    first, second = (verdict_stability(values, "yes", is_majority_positive) for _ in range(2))
    assert first == second
    # Equal values are undecided in every bootstrap sample.
    values = np.full(6, 3.0)
    for is_paired in (False, True):
        assert direction_stability(values, values, 0, 0.05, is_paired=is_paired) == 1


def naive_direction(a: Sample, b: Sample, level: float, is_paired: bool) -> int:
    effect = float(np.median(a - b) if is_paired else np.median(a) - np.median(b))
    if is_paired:
        p = float(stats.binomtest(int((a > b).sum()), int((a != b).sum())).pvalue)
        a12 = float(np.mean(a > b) + np.mean(a == b) / 2)
    else:
        p = float(stats.mannwhitneyu(a, b, method="exact").pvalue)
        a12 = float(np.mean(a[:, None] > b) + np.mean(a[:, None] == b) / 2)
    if p >= level or np.sign(effect) != np.sign(a12 - 0.5):
        return 0
    return int(np.sign(effect))


@pytest.mark.parametrize(("is_paired", "shift"), [(False, 0.8), (True, 1.2)])
def test_the_stability_of_a_direction_is_its_share_of_bootstrap_samples(
    is_paired: bool, shift: float
) -> None:
    """The oracle draws its own samples and decides each of them alone."""
    generator = np.random.default_rng(7)
    a = generator.normal(shift, 1, 20)
    b = generator.normal(0, 1, 20)
    counts = {-1: 0, 0: 0, 1: 0}
    for _ in range(500):
        indices = generator.integers(0, 20, 20)
        indices_b = indices if is_paired else generator.integers(0, 20, 20)
        counts[naive_direction(a[indices], b[indices_b], 0.01, is_paired)] += 1
    for direction, count in counts.items():
        share = direction_stability(a, b, direction, 0.01, is_paired=is_paired)
        # Five standard errors of the difference of two shares.
        assert share == pytest.approx(count / 500, abs=5 * np.sqrt(2 * 0.25 / 500))
    assert 0.1 < counts[1] / 500 < 0.9


@pytest.mark.parametrize(
    ("size_a", "size_b", "method"),
    [
        (6, 20, "Mann-Whitney"),
        (8, 8, "Mann-Whitney"),
        (3, 100, "Mann-Whitney"),
        (9, 9, "sign"),
        (14, 14, "sign"),
    ],
)
def test_a_verdict_at_the_smallest_p_value_is_stable(
    size_a: int, size_b: int, method: TestMethod
) -> None:
    """Samples far apart are separated in every bootstrap sample, so that p is always smallest."""
    level = 1.01 * PlannedTest(size_a, size_b, method).smallest_p
    a = 1000 + np.random.default_rng(1).normal(size=size_a)
    b = np.random.default_rng(2).normal(size=size_b)
    is_paired = method == "sign"
    assert direction_stability(a, b, 1, level, is_paired=is_paired) == 1
