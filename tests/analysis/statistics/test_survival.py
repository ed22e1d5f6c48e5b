"""Tests of survival statistics against a textbook, SciPy, and uncensored samples."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from scipy import stats

from baldwinlab.analysis.statistics.hypothesis_tests import mann_whitney
from baldwinlab.analysis.statistics.survival import (
    Survival,
    compare_survival,
    log_rank,
    median,
    restricted_mean,
)


def survival(dead: list[float], alive: list[float]) -> Survival:
    """Return a sample from times of death and censored times."""
    return Survival(
        np.array([*dead, *alive], np.float64), np.arange(len(dead) + len(alive)) >= len(dead)
    )


DRUG = survival([6, 6, 6, 7, 10, 13, 16, 22, 23], [6, 9, 10, 11, 17, 19, 20, 25, 32, 32, 34, 35])
PLACEBO = survival([1, 1, 2, 2, 3, 4, 4, 5, 5, 8, 8, 8, 8, 11, 11, 12, 12, 15, 17, 22, 23], [])


def test_the_comparison_agrees_with_a_textbook() -> None:
    """Compare with Kleinbaum and Klein, Survival Analysis, on 6-mercaptopurine in leukemia.

    Chi-square is 16.79 with one degree of freedom. The medians are 23 and 8 weeks, and the mean of
    the placebo is 182 / 21 weeks.
    Data: E. J. Freireich et al., Blood 21 (1963).
    """
    comparison = compare_survival(DRUG, PLACEBO)
    assert comparison.p == pytest.approx(stats.chi2.sf(16.79, 1), rel=2e-3)
    assert (comparison.median_a, comparison.median_b) == (23, 8)
    assert restricted_mean(PLACEBO, 35) == pytest.approx(182 / 21)
    assert 0 < comparison.low < comparison.effect < comparison.high
    assert comparison.u == pytest.approx(math.sqrt(16.79), rel=1e-3)
    swapped = compare_survival(PLACEBO, DRUG)
    assert (swapped.effect, swapped.u) == pytest.approx((-comparison.effect, -comparison.u))
    assert (swapped.p, swapped.a12) == pytest.approx((comparison.p, 1 - comparison.a12))


runs = some.lists(
    some.tuples(some.integers(1, 9).map(float), some.booleans()), min_size=2, max_size=9
)


def make_survival(times: list[tuple[float, bool]]) -> Survival:
    return Survival(
        np.array([time for time, _ in times]), np.array([censored for _, censored in times])
    )


@given(runs, runs, some.floats(0.5, 9))
@settings(max_examples=60)
def test_the_test_and_the_curve_agree_with_scipy(
    a: list[tuple[float, bool]], b: list[tuple[float, bool]], until: float
) -> None:
    first = make_survival(a)
    second = make_survival(b)
    scipy_first, scipy_second = (
        stats.CensoredData.right_censored(*sample) for sample in (first, second)
    )
    with np.errstate(all="ignore"):
        p = stats.logrank(scipy_first, scipy_second).pvalue
        curve = stats.ecdf(scipy_first).sf
    assert log_rank(first, second)[1] == pytest.approx(1.0 if math.isnan(p) else p)
    fine = (np.arange(100_000) + 0.5) / 100_000 * until
    assert restricted_mean(first, until) == pytest.approx(
        curve.evaluate(fine).mean() * until, abs=1e-3
    )


@given(
    some.lists(some.integers(1, 9).map(float), min_size=1, max_size=9),
    some.lists(some.integers(1, 9).map(float), min_size=1),
)
@settings(max_examples=40)
def test_uncensored_samples_have_plain_means_medians_and_pairs(
    a: list[float], b: list[float]
) -> None:
    comparison = compare_survival(survival(a, []), survival(b, []))
    assert comparison.effect == pytest.approx(np.mean(a) - np.mean(b))
    assert (comparison.median_a, comparison.median_b) == (np.median(a), np.median(b))
    assert comparison.a12 == pytest.approx(
        mann_whitney(np.array(a), np.array(b))[0] / (len(a) * len(b))
    )


def test_the_order_of_censored_runs_and_deaths() -> None:
    assert compare_survival(survival([], [9, 9]), survival([9, 9], [])).a12 == 1
    # The order of two censored runs is unknown.
    assert compare_survival(survival([], [3]), survival([5], [])).a12 == 0.5
    assert compare_survival(survival([], [5, 5]), survival([], [5, 5, 5])).a12 == 0.5
    # One sample is censored at 4. The other has its last death at 10, but counts only up to 4.
    comparison = compare_survival(survival([2], [4]), survival([2, 10], []))
    assert comparison.effect == pytest.approx(3 - 3)
    # A median that is not reached is nan.
    assert math.isnan(median(survival([1], [9, 9])))
    assert math.isnan(median(survival([1, 2], [9, 9]))), (
        "the curve stays at 1/2: the median may be anything above 2"
    )
    assert median(survival([1, 2, 3], [9, 9])) == 3


def test_equal_samples_without_order_of_deaths_are_not_distinguished() -> None:
    for sample in (survival([], [7, 7, 7]), survival([7, 7, 7], [])):
        comparison = compare_survival(sample, sample)
        assert (comparison.u, comparison.p, comparison.effect) == (0, 1, 0)
        assert (comparison.low, comparison.high, comparison.a12) == (0, 0, 0.5)


def test_the_interval_agrees_with_the_closed_form_variance() -> None:
    """Compare with Klein and Moeschberger, Survival Analysis (1997), section 4.5.

    The variance of a restricted mean is the sum over deaths of
    (area after the death)^2 dying / (at risk (at risk - dying)).
    """

    def variance(sample: Survival, until: float) -> float:
        total = 0.0
        for time in np.unique(sample.times[~sample.censored]):
            at_risk = (sample.times >= time).sum()
            dying = ((sample.times == time) & ~sample.censored).sum()
            after = restricted_mean(sample, until) - restricted_mean(sample, float(time))
            if at_risk > dying:
                total += float(after**2 * dying / (at_risk * (at_risk - dying)))
        return total

    random = np.random.default_rng(8)
    samples = [random.exponential(mean, 200) for mean in (1, 2)]
    first, second = (Survival(np.minimum(times, 2), times > 2) for times in samples)
    comparison = compare_survival(first, second)
    half = 1.96 * math.sqrt(variance(first, 2) + variance(second, 2))
    expected = (comparison.effect - half, comparison.effect + half)
    assert (comparison.low, comparison.high) == pytest.approx(expected, abs=0.05 * half)


def test_a_single_run_has_no_interval_and_results_are_reproducible() -> None:
    single = compare_survival(survival([3], []), DRUG)
    assert math.isnan(single.low) and math.isnan(single.high)
    assert compare_survival(DRUG, PLACEBO) == compare_survival(DRUG, PLACEBO)


@pytest.mark.parametrize("times", [[], [math.nan, 1]])
def test_an_invalid_sample_is_refused(times: list[float]) -> None:
    with pytest.raises(ValueError, match="a sample needs at least one value, and all finite"):
        compare_survival(survival(times, []), PLACEBO)
