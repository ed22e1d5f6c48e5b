"""The rules that decide a comparison: each takes what was found, and its bound, and gives a verdict.

A paper's claims name them; `papers.claims.RULES` says in words what they do.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Literal

from baldwinlab.statistics import Comparison

Verdict = Literal["holds", "does not hold", "undecided", "not evaluated"]
HOLDS: Verdict = "holds"
FAILS: Verdict = "does not hold"
UNDECIDED: Verdict = "undecided"
NOT_EVALUATED: Verdict = "not evaluated"
VERDICTS = (HOLDS, UNDECIDED, FAILS, NOT_EVALUATED)

MARKS: Mapping[Verdict, str] = {HOLDS: "✓", UNDECIDED: "?", FAILS: "✗", NOT_EVALUATED: "–"}  # where there is no room for words

SIGNIFICANT = 0.05


def greater(found: Comparison, p_holm: float, bound: float | None) -> Verdict:
    return {1: HOLDS, 0: UNDECIDED, -1: FAILS}[_direction(found, p_holm)]


def lower(found: Comparison, p_holm: float, bound: float | None) -> Verdict:
    return {1: FAILS, 0: UNDECIDED, -1: HOLDS}[_direction(found, p_holm)]


def _direction(found: Comparison, p_holm: float) -> int:
    """1 where a is significantly the larger, in the median and in A12; -1 where the smaller; else 0."""
    if not p_holm < SIGNIFICANT:
        return 0
    if found.effect > 0 and found.a12 > 0.5:
        return 1
    return -1 if found.effect < 0 and found.a12 < 0.5 else 0


def zero(found: Comparison, p_holm: float, bound: float | None) -> Verdict:
    return HOLDS if found.effect == 0 else FAILS


def at_least(found: Comparison, p_holm: float, bound: float | None) -> Verdict:
    """A single run has no interval and decides nothing."""
    if bound is not None and found.low >= bound:
        return HOLDS
    return FAILS if bound is not None and found.high < bound else UNDECIDED


RULES: Mapping[str, Callable[[Comparison, float, float | None], Verdict]] = {
    "greater": greater,
    "lower": lower,
    "zero": zero,
    "at_least": at_least,
}


def conjunction(verdicts: list[Verdict]) -> Verdict:
    """A claim holds if all of it holds, and does not hold if any of it does not."""
    if not verdicts:
        return NOT_EVALUATED
    if FAILS in verdicts:
        return FAILS
    return HOLDS if set(verdicts) == {HOLDS} else UNDECIDED
