"""Survival times against a textbook's example, against SciPy, and against what holds of them where nobody is censored."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from scipy import stats

from baldwinlab.statistics import compare, mann_whitney
from baldwinlab.statistics.survival import (
    Survival,
    compare_survival,
    log_rank,
    median,
    restricted_mean,
)


def survival(dead: list[float], alive: list[float]) -> Survival:
    """Times at which some die, and those at which others are left alone."""
    return Survival(
        np.array([*dead, *alive], np.float64), np.arange(len(dead) + len(alive)) >= len(dead)
    )


DRUG = survival([6, 6, 6, 7, 10, 13, 16, 22, 23], [6, 9, 10, 11, 17, 19, 20, 25, 32, 32, 34, 35])
PLACEBO = survival([1, 1, 2, 2, 3, 4, 4, 5, 5, 8, 8, 8, 8, 11, 11, 12, 12, 15, 17, 22, 23], [])


def test_weeks_in_remission_are_compared_as_in_textbooks() -> None:
    """Compare with Kleinbaum and Klein, Survival Analysis, on 6-mercaptopurine in leukemia.

    Chi-square 16.79 with one degree of freedom, medians of 23 and 8 weeks, mean of the placebo 182 / 21 weeks.
    Data: E. J. Freireich et al., Blood 21 (1963).
    """
    found = compare_survival(DRUG, PLACEBO)
    assert found.p == pytest.approx(stats.chi2.sf(16.79, 1), rel=2e-3)
    assert (found.median_a, found.median_b) == (23, 8)
    assert restricted_mean(PLACEBO, 35) == pytest.approx(182 / 21)
    assert 0 < found.low < found.effect < found.high
    other = compare_survival(PLACEBO, DRUG)
    assert (other.effect, other.u) == pytest.approx(
        (-found.effect, -found.u)
    ) and found.u == pytest.approx(math.sqrt(16.79), rel=1e-3)
    assert (other.p, other.a12) == pytest.approx((found.p, 1 - found.a12))


runs = some.lists(
    some.tuples(some.integers(1, 9).map(float), some.booleans()), min_size=2, max_size=9
)


def made(times: list[tuple[float, bool]]) -> Survival:
    return Survival(
        np.array([time for time, _ in times]), np.array([censored for _, censored in times])
    )


@given(runs, runs, some.floats(0.5, 9))
@settings(deadline=None, max_examples=60)
def test_the_test_and_the_curve_are_those_of_scipy(
    a: list[tuple[float, bool]], b: list[tuple[float, bool]], until: float
) -> None:
    one, other = made(a), made(b)
    theirs, others = (stats.CensoredData.right_censored(*each) for each in (one, other))
    with np.errstate(all="ignore"):
        p = stats.logrank(theirs, others).pvalue
        curve = stats.ecdf(theirs).sf
    assert log_rank(one, other)[1] == pytest.approx(1.0 if math.isnan(p) else p)
    fine = (np.arange(100_000) + 0.5) / 100_000 * until
    assert restricted_mean(one, until) == pytest.approx(
        curve.evaluate(fine).mean() * until, abs=1e-3
    )


@given(
    some.lists(some.integers(1, 9).map(float), min_size=1, max_size=9),
    some.lists(some.integers(1, 9).map(float), min_size=1),
)
@settings(deadline=None, max_examples=40)
def test_where_nobody_is_censored_means_medians_and_pairs_are_the_plain_ones(
    a: list[float], b: list[float]
) -> None:
    found = compare_survival(survival(a, []), survival(b, []))
    assert found.effect == pytest.approx(np.mean(a) - np.mean(b))
    assert (found.median_a, found.median_b) == (np.median(a), np.median(b))
    assert found.a12 == pytest.approx(mann_whitney(np.array(a), np.array(b))[0] / (len(a) * len(b)))


def test_who_is_left_alone_alive_outlives_who_died_then() -> None:
    assert compare_survival(survival([], [9, 9]), survival([9, 9], [])).a12 == 1


def test_of_two_who_are_censored_nobody_knows_which_lasts_longer() -> None:
    assert compare_survival(survival([], [3]), survival([5], [])).a12 == 0.5
    assert compare_survival(survival([], [5, 5]), survival([], [5, 5, 5])).a12 == 0.5


def test_the_mean_is_restricted_to_what_is_known_of_both() -> None:
    """One sample is left alone at 4, the other followed to its last death at 10: what comes after 4 counts for neither."""
    found = compare_survival(survival([2], [4]), survival([2, 10], []))
    assert found.effect == pytest.approx(3 - 3)


def test_a_median_that_is_not_reached_does_not_exist() -> None:
    assert math.isnan(median(survival([1], [9, 9])))
    assert math.isnan(median(survival([1, 2], [9, 9]))), "half live on: it may be anything above 2"
    assert median(survival([1, 2, 3], [9, 9])) == 3


def test_where_nobody_dies_or_all_at_once_nothing_is_told() -> None:
    for alike in (survival([], [7, 7, 7]), survival([7, 7, 7], [])):
        found = compare_survival(alike, alike)
        assert (found.u, found.p, found.effect, found.low, found.high, found.a12) == (
            0,
            1,
            0,
            0,
            0,
            0.5,
        )


def test_the_interval_is_about_that_of_the_variance_in_closed_form() -> None:
    """Compare with the variance of a restricted mean: Klein and Moeschberger, Survival Analysis (1997), section 4.5.

    It is the sum over deaths of (area after it)^2 dying / (at risk (at risk - dying)).
    """

    def variance(sample: Survival, until: float) -> float:
        found = 0.0
        for time in np.unique(sample.times[~sample.censored]):
            at_risk, dying = (
                (sample.times >= time).sum(),
                ((sample.times == time) & ~sample.censored).sum(),
            )
            after = restricted_mean(sample, until) - restricted_mean(sample, float(time))
            found += after**2 * dying / (at_risk * (at_risk - dying)) if at_risk > dying else 0.0
        return float(found)

    random = np.random.default_rng(8)
    samples = [random.exponential(mean, 200) for mean in (1, 2)]
    one, other = (Survival(np.minimum(times, 2), times > 2) for times in samples)
    found, half = (
        compare_survival(one, other),
        1.96 * math.sqrt(variance(one, 2) + variance(other, 2)),
    )
    assert (found.low, found.high) == pytest.approx(
        (found.effect - half, found.effect + half), abs=0.05 * half
    )


def test_of_one_run_there_is_no_interval_and_the_same_samples_give_the_same() -> None:
    alone = compare_survival(survival([3], []), DRUG)
    assert math.isnan(alone.low) and math.isnan(alone.high)
    assert compare_survival(DRUG, PLACEBO) == compare_survival(DRUG, PLACEBO)


@pytest.mark.parametrize("times", [[], [math.nan, 1]])
def test_what_is_no_sample_is_refused_as_by_compare(times: list[float]) -> None:
    with pytest.raises(ValueError, match="a sample needs at least one value, and all finite"):
        compare(times, [1])
    with pytest.raises(ValueError, match="a sample needs at least one value, and all finite"):
        compare_survival(survival(times, []), PLACEBO)
