"""Intervals of probabilities, compared with their definition, and the hurdle model.

The random-effects summary of papers is compared with published results and closed forms.
"""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import ValidationError
from scipy import stats

from baldwinlab.analysis.results.verdicts import decide
from baldwinlab.analysis.statistics.comparisons import Comparison
from baldwinlab.analysis.statistics.intervals import (
    combine_papers,
    estimate_probability,
    measure_hurdle,
    proportion_interval,
)
from baldwinlab.papers.claims import ClaimComparison
from baldwinlab.papers.rules import RULES

# Thirteen trials of a vaccine: tuberculosis and no tuberculosis with and without vaccination.
# G. A. Colditz and others, Journal of the American Medical Association 271 (1994).
VACCINATED = np.array([
    [4, 119], [6, 300], [3, 228], [62, 13536], [33, 5036], [180, 1361], [8, 2537],
    [505, 87886], [29, 7470], [17, 1699], [186, 50448], [5, 2493], [27, 16886],
])  # fmt: skip
CONTROLS = np.array([
    [11, 128], [29, 274], [11, 209], [248, 12619], [47, 5761], [372, 1079], [10, 619],
    [499, 87892], [45, 7232], [65, 1600], [141, 27197], [3, 2338], [29, 17825],
])  # fmt: skip


@pytest.mark.parametrize(("successes", "runs"), [(0, 20), (1, 20), (10, 20), (20, 20)])
def test_the_ends_of_an_interval_have_a_tail_of_2_5_percent(successes: int, runs: int) -> None:
    low, high = proportion_interval(successes, runs)
    # The ends are 0 and 1 without successes and without failures.
    assert (low == 0) == (successes == 0) and (high == 1) == (successes == runs)
    if low > 0:
        assert stats.binom.sf(successes - 1, runs, low) == pytest.approx(0.025)
    if high < 1:
        assert stats.binom.cdf(successes, runs, high) == pytest.approx(0.025)


def test_a_probability_is_the_share_of_runs_of_which_each_is_0_or_1() -> None:
    probability, low, high = estimate_probability(np.array([1.0, 0, 0, 0]))
    assert probability == 0.25
    assert (low, high) == proportion_interval(1, 4)
    with pytest.raises(ValueError, match="must be 0 or 1"):
        estimate_probability(np.array([0.0, 0.5]))
    with pytest.raises(ValidationError, match="needs a measure that is 0 or 1, a bound, and no b"):
        ClaimComparison(a="x", measure="mean", rule="probability_above", bound=0.05)


@pytest.mark.parametrize(
    ("interval", "above", "below", "equal"),
    [
        ((0.1, 0.2), "holds", "does not hold", "does not hold"),
        ((0.01, 0.02), "does not hold", "holds", "does not hold"),
        ((0.01, 0.2), "undecided", "undecided", "holds"),
    ],
)
def test_the_interval_decides_a_claim_about_a_probability(
    interval: tuple[float, float], above: str, below: str, equal: str
) -> None:
    nan = float("nan")
    low, high = interval
    numbers = Comparison(20, 0, 0.0, nan, (low + high) / 2, low, high, nan, nan, nan)
    verdicts = [
        decide(RULES[f"probability_{name}"], numbers, nan, 0.05)
        for name in ("above", "below", "equals")
    ]
    assert verdicts == [above, below, equal]
    few = numbers._replace(n_a=5)
    assert decide(RULES["probability_equals"], few, nan, 0.05) == "undecided"


def test_size_is_that_of_runs_above_the_threshold() -> None:
    hurdle = measure_hurdle(np.array([0.0, 0.0, 0.01, 5.0, 6.0, 7.0]), 0.05)
    assert (hurdle.takeoffs, hurdle.runs, hurdle.size) == (3, 6, 6.0)
    assert hurdle.is_bimodal
    # The interval of the share has tails of two and a half percent.
    hurdle = measure_hurdle(np.array([0.0] * 8 + [1.0] * 4), 0.5)
    assert stats.binom.sf(3, 12, hurdle.share_low) == pytest.approx(0.025)
    assert stats.binom.cdf(4, 12, hurdle.share_high) == pytest.approx(0.025)
    # Without takeoff the size is undefined.
    hurdle = measure_hurdle(np.zeros(10), 0.0)
    assert hurdle.takeoffs == 0 and np.isnan(hurdle.size) and not hurdle.is_bimodal
    # The interval of 0 of 10 ends at 1 - 0.025 ** (1 / 10).
    assert hurdle.share_high == pytest.approx(1 - 0.025**0.1)


def test_the_summary_of_thirteen_trials_is_that_of_metafor() -> None:
    """Compare with `rma(method="PM", test="knha")` of the R package metafor.

    tau^2 = 0.3181, mean = -0.7150, standard error = 0.1809.
    """
    treated, control = VACCINATED.sum(axis=1), CONTROLS.sum(axis=1)
    effects = np.log(VACCINATED[:, 0] / treated) - np.log(CONTROLS[:, 0] / control)
    variances = 1 / VACCINATED[:, 0] - 1 / treated + 1 / CONTROLS[:, 0] - 1 / control
    summary = combine_papers(effects, np.sqrt(variances))
    assert summary.spread**2 == pytest.approx(0.3181, abs=1e-4)
    assert summary.mean == pytest.approx(-0.7150, abs=1e-4)
    assert summary.high - summary.mean == pytest.approx(stats.t.ppf(0.975, 12) * 0.1809, abs=1e-3)


def test_with_equal_precision_the_interval_is_that_of_students_t() -> None:
    effects = np.array([0.2, 0.9, -0.4, 1.3, 0.6])
    summary = combine_papers(effects, np.full(5, 0.1))
    expected = stats.ttest_1samp(effects, 0).confidence_interval(0.95)
    assert (summary.low, summary.high) == pytest.approx((expected.low, expected.high))
    # The estimating equation of Paule and Mandel for equal precision.
    assert summary.spread**2 == pytest.approx(effects.var(ddof=1) - 0.1**2, abs=1e-4)
    # Equal effects have no spread.
    summary = combine_papers(np.full(4, 0.3), np.array([0.1, 0.2, 0.1, 0.3]))
    assert summary.spread == 0
    assert summary.low == pytest.approx(0.3) and summary.prediction_high == pytest.approx(0.3)


@pytest.mark.nightly
def test_the_prediction_interval_contains_nineteen_of_twenty_new_papers() -> None:
    generator = np.random.default_rng(7)
    hits = 0
    for _ in range(1000):
        errors = generator.uniform(0.05, 0.3, 10)
        true_effects = generator.normal(0.5, 0.4, 11)
        summary = combine_papers(true_effects[:10] + generator.normal(0, errors), errors)
        hits += summary.prediction_low < true_effects[10] < summary.prediction_high
    assert 0.92 < hits / 1000 < 0.98
