"""The rules that decide a comparison: each takes what was found, and its bound, and gives a verdict.

A paper's claims name them; `papers.claims.RULES` says in words what they do.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, Literal

import numpy as np

from baldwinlab.statistics import Comparison

Verdict = Literal["holds", "does not hold", "undecided", "not evaluated"]
HOLDS: Verdict = "holds"
FAILS: Verdict = "does not hold"
UNDECIDED: Verdict = "undecided"
NOT_EVALUATED: Verdict = "not evaluated"
VERDICTS = (HOLDS, UNDECIDED, FAILS, NOT_EVALUATED)

MARKS: Mapping[Verdict, str] = {
    HOLDS: "✓",
    UNDECIDED: "?",
    FAILS: "✗",
    NOT_EVALUATED: "–",
}  # where there is no room for words

SIGNIFICANT = 0.05


Bound = Any  # a number, or for `within` two, or None for rules that ask for none


def greater(found: Comparison, p_holm: float, bound: Bound) -> Verdict:
    return {1: HOLDS, 0: UNDECIDED, -1: FAILS}[direction(found, p_holm)]


def lower(found: Comparison, p_holm: float, bound: Bound) -> Verdict:
    return {1: FAILS, 0: UNDECIDED, -1: HOLDS}[direction(found, p_holm)]


def direction(found: Comparison, p_holm: float) -> int:
    """Return 1 where a is significantly larger, in the median and in A12; -1 where it is smaller; else 0."""
    if not p_holm < SIGNIFICANT:
        return 0
    if found.effect > 0 and found.a12 > 0.5:
        return 1
    return -1 if found.effect < 0 and found.a12 < 0.5 else 0


def close(found: Comparison, p_holm: float, bound: Bound) -> Verdict:
    return within(found, p_holm, (-bound, bound))


def survives_longer(found: Comparison, p_holm: float, bound: Bound) -> Verdict:
    """Of what `statistics.survival` finds: significantly, in the log-rank test and in the restricted mean."""
    if p_holm < SIGNIFICANT and found.u * found.effect > 0:
        return HOLDS if found.effect > 0 else FAILS
    return UNDECIDED


def zero(found: Comparison, p_holm: float, bound: Bound) -> Verdict:
    return HOLDS if found.effect == 0 else FAILS


def at_least(found: Comparison, p_holm: float, bound: Bound) -> Verdict:
    return within(found, p_holm, (bound, math.inf))


def within(found: Comparison, p_holm: float, bound: Bound) -> Verdict:
    """A single run has no interval and decides nothing."""
    lowest, highest = bound
    if found.low >= lowest and found.high <= highest:
        return HOLDS
    return FAILS if found.high < lowest or found.low > highest else UNDECIDED


def is_within(found: Comparison, p_holm: float, bound: Bound) -> Verdict:
    """Of a number that is what it is: the mean of all runs, or the least or the greatest of them. None decides nothing."""
    lowest, highest = bound
    if math.isnan(found.effect):
        return UNDECIDED
    return HOLDS if lowest <= found.effect <= highest else FAILS


def at_most(found: Comparison, p_holm: float, bound: Bound) -> Verdict:
    return is_within(found, p_holm, (-math.inf, bound))


def no_less(found: Comparison, p_holm: float, bound: Bound) -> Verdict:
    return is_within(found, p_holm, (bound, math.inf))


RULES: Mapping[str, Callable[[Comparison, float, Bound], Verdict]] = {
    "greater": greater,
    "lower": lower,
    "close": close,
    "survives_longer": survives_longer,
    "zero": zero,
    "at_least": at_least,
    "within": within,
    "mean_within": is_within,
    "mean_at_most": at_most,
    "every_at_most": at_most,
    "every_at_least": no_less,
}
BY_P_VALUE = ("greater", "lower", "survives_longer")
"""The rules whose verdict depends on the p-value."""
OVER_RUNS: Mapping[str, Callable[[Any], Any]] = {
    "mean_within": np.mean,
    "mean_at_most": np.mean,
    "every_at_most": np.max,
    "every_at_least": np.min,
}
"""What a rule asks of all runs together, in place of their median."""


def conjunction(verdicts: list[Verdict]) -> Verdict:
    """A claim holds if all of it holds, and does not hold if any of it does not."""
    if not verdicts:
        return NOT_EVALUATED
    if FAILS in verdicts:
        return FAILS
    return HOLDS if set(verdicts) == {HOLDS} else UNDECIDED
