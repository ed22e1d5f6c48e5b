"""Decide claims: each rule takes a comparison and a bound, and returns a verdict.

The claims of a paper name the rules; `papers.claims.RULES` describes them in sentences.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, Literal

import numpy as np

from baldwinlab.analysis.statistics.comparisons import Comparison

Verdict = Literal["holds", "does not hold", "undecided", "not evaluated"]
HOLDS: Verdict = "holds"
FAILS: Verdict = "does not hold"
UNDECIDED: Verdict = "undecided"
NOT_EVALUATED: Verdict = "not evaluated"
VERDICTS = (HOLDS, UNDECIDED, FAILS, NOT_EVALUATED)
VERDICT_MARKS: Mapping[Verdict, str] = {HOLDS: "✓", UNDECIDED: "?", FAILS: "✗", NOT_EVALUATED: "–"}
"""Marks for cells that are too small for a verdict in words."""

SIGNIFICANCE_LEVEL = 0.05

# A number; a pair of numbers for `within`; None for a rule without a bound.
Bound = Any


def direction(comparison: Comparison, p_holm: float) -> int:
    """Return 1 or -1 for a significantly larger or smaller a, in the effect and in A12; else 0."""
    if not p_holm < SIGNIFICANCE_LEVEL:
        return 0
    if comparison.effect > 0 and comparison.a12 > 0.5:
        return 1
    return -1 if comparison.effect < 0 and comparison.a12 < 0.5 else 0


def greater(comparison: Comparison, p_holm: float, bound: Bound) -> Verdict:
    """Decide the claim that a is significantly larger than b."""
    return {1: HOLDS, 0: UNDECIDED, -1: FAILS}[direction(comparison, p_holm)]


def lower(comparison: Comparison, p_holm: float, bound: Bound) -> Verdict:
    """Decide the claim that a is significantly smaller than b."""
    return {1: FAILS, 0: UNDECIDED, -1: HOLDS}[direction(comparison, p_holm)]


def survives_longer(comparison: Comparison, p_holm: float, bound: Bound) -> Verdict:
    """Decide the claim that a survives longer than b.

    It is undecided, unless the log-rank test is significant and its statistic has the sign of the
    effect, which is the difference of the restricted means.
    """
    if p_holm < SIGNIFICANCE_LEVEL and comparison.u * comparison.effect > 0:
        return HOLDS if comparison.effect > 0 else FAILS
    return UNDECIDED


def zero(comparison: Comparison, p_holm: float, bound: Bound) -> Verdict:
    """Decide the claim that the effect is exactly 0."""
    return HOLDS if comparison.effect == 0 else FAILS


def within(comparison: Comparison, p_holm: float, bound: Bound) -> Verdict:
    """Decide the claim that the effect is between two bounds, by its interval.

    A single run has no interval, so its claim is undecided.
    """
    lowest, highest = bound
    if comparison.low >= lowest and comparison.high <= highest:
        return HOLDS
    return FAILS if comparison.high < lowest or comparison.low > highest else UNDECIDED


def close(comparison: Comparison, p_holm: float, bound: Bound) -> Verdict:
    """Decide the claim that the effect is at most `bound` in either direction; see `within`."""
    return within(comparison, p_holm, (-bound, bound))


def at_least(comparison: Comparison, p_holm: float, bound: Bound) -> Verdict:
    """Decide the claim that the effect is at least `bound`; see `within`."""
    return within(comparison, p_holm, (bound, math.inf))


def number_within(comparison: Comparison, p_holm: float, bound: Bound) -> Verdict:
    """Decide the claim that a number without an interval is between two bounds.

    The number is the mean, the smallest or the largest value of all runs: see `RUN_STATISTICS`.
    The claim is undecided if it is NaN.
    """
    lowest, highest = bound
    if math.isnan(comparison.effect):
        return UNDECIDED
    return HOLDS if lowest <= comparison.effect <= highest else FAILS


def number_at_most(comparison: Comparison, p_holm: float, bound: Bound) -> Verdict:
    """Decide the claim that a number is at most `bound`; see `number_within`."""
    return number_within(comparison, p_holm, (-math.inf, bound))


def number_at_least(comparison: Comparison, p_holm: float, bound: Bound) -> Verdict:
    """Decide the claim that a number is at least `bound`; see `number_within`."""
    return number_within(comparison, p_holm, (bound, math.inf))


def probability_above(comparison: Comparison, p_holm: float, bound: Bound) -> Verdict:
    """Decide the claim that a probability is above `bound`, by its interval."""
    if comparison.low > bound:
        return HOLDS
    return FAILS if comparison.high < bound else UNDECIDED


def probability_below(comparison: Comparison, p_holm: float, bound: Bound) -> Verdict:
    """Decide the claim that a probability is below `bound`; see `probability_above`."""
    opposites = {HOLDS: FAILS, FAILS: HOLDS, UNDECIDED: UNDECIDED}
    return opposites[probability_above(comparison, p_holm, bound)]


def probability_equals(comparison: Comparison, p_holm: float, bound: Bound) -> Verdict:
    """Decide the claim that the interval of a probability contains `bound`."""
    return HOLDS if comparison.low <= bound <= comparison.high else FAILS


RULES: Mapping[str, Callable[[Comparison, float, Bound], Verdict]] = {
    "greater": greater,
    "lower": lower,
    "close": close,
    "survives_longer": survives_longer,
    "zero": zero,
    "at_least": at_least,
    "within": within,
    "mean_within": number_within,
    "mean_at_most": number_at_most,
    "every_at_most": number_at_most,
    "every_at_least": number_at_least,
    "probability_above": probability_above,
    "probability_below": probability_below,
    "probability_equals": probability_equals,
}
DIRECTION_RULES = ("greater", "lower")
"""The rules whose verdict depends on the direction of a rank test."""
P_VALUE_RULES = (*DIRECTION_RULES, "survives_longer")
"""The rules whose verdict depends on the p-value."""
INTERVAL_BOUNDS: Mapping[str, Callable[[Bound], tuple[float, ...]]] = {
    "within": tuple,
    "close": lambda bound: (-bound, bound),
    "at_least": lambda bound: (bound,),
    "probability_above": lambda bound: (bound,),
    "probability_below": lambda bound: (bound,),
}
"""The bounds of the rules whose verdict depends on the interval of the effect."""
RUN_STATISTICS: Mapping[str, Callable[[Any], Any]] = {
    "mean_within": np.mean,
    "mean_at_most": np.mean,
    "every_at_most": np.max,
    "every_at_least": np.min,
}
"""The statistic over all runs that a rule uses instead of the median."""


def combine_verdicts(verdicts: list[Verdict]) -> Verdict:
    """Combine the verdicts of the parts of a claim. A claim without a part is not evaluated."""
    if not verdicts:
        return NOT_EVALUATED
    if FAILS in verdicts:
        return FAILS
    return HOLDS if set(verdicts) == {HOLDS} else UNDECIDED
