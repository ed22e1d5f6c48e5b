"""Intervals of probabilities, compared with their definition, and the hurdle model."""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import ValidationError
from scipy import stats

from baldwinlab.analysis.results.verdicts import decide
from baldwinlab.analysis.statistics.comparisons import Comparison
from baldwinlab.analysis.statistics.intervals import (
    estimate_probability,
    measure_hurdle,
    proportion_interval,
)
from baldwinlab.papers.claims import ClaimComparison
from baldwinlab.papers.rules import RULES


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
