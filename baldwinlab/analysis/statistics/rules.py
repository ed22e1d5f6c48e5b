"""Verdicts of claims: apply the rules of `papers.rules` to the numbers of comparisons."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final, Literal

from baldwinlab.analysis.statistics.comparisons import Comparison
from baldwinlab.papers.rules import Bound, Rule

Verdict = Literal["holds", "does not hold", "undecided", "not evaluated"]
HOLDS: Verdict = "holds"
FAILS: Verdict = "does not hold"
UNDECIDED: Verdict = "undecided"
NOT_EVALUATED: Verdict = "not evaluated"
VERDICTS = (HOLDS, UNDECIDED, FAILS, NOT_EVALUATED)
VERDICT_MARKS: Mapping[Verdict, str] = {HOLDS: "✓", UNDECIDED: "?", FAILS: "✗", NOT_EVALUATED: "–"}
"""Marks for cells that are too small for a verdict in words."""

SIGNIFICANCE_LEVEL = 0.05

# With fewer runs, the 95 % interval of a median has a smaller coverage, as the sign test shows.
MIN_INTERVAL_RUNS: Final = 6


def direction(comparison: Comparison, p_holm: float) -> int:
    """Return 1 or -1 for a significantly larger or smaller a, in the effect and in A12; else 0."""
    if not p_holm < SIGNIFICANCE_LEVEL:
        return 0
    if comparison.effect > 0 and comparison.a12 > 0.5:
        return 1
    return -1 if comparison.effect < 0 and comparison.a12 < 0.5 else 0


def decide(rule: Rule, comparison: Comparison, p_holm: float, bound: Bound) -> Verdict:
    """Decide the comparison of a claim by a rule. See `papers.rules.Rule`."""
    if rule.kind == "direction":
        return {1: HOLDS, 0: UNDECIDED, -1: FAILS}[rule.sign * direction(comparison, p_holm)]
    if rule.kind == "survival":
        return _decide_survival(comparison, p_holm)
    if rule.kind == "interval":
        return _decide_interval(rule, comparison, bound)
    lowest, highest = rule.limits(bound)
    if math.isnan(comparison.effect):
        return UNDECIDED
    return HOLDS if lowest <= comparison.effect <= highest else FAILS


def _decide_survival(comparison: Comparison, p_holm: float) -> Verdict:
    """Decide the claim that a survives longer than b.

    It is undecided, unless the log-rank test is significant and its statistic has the sign of the
    effect, which is the difference of the restricted means.
    """
    if p_holm < SIGNIFICANCE_LEVEL and comparison.u * comparison.effect > 0:
        return HOLDS if comparison.effect > 0 else FAILS
    return UNDECIDED


def has_enough_runs(comparison: Comparison) -> bool:
    """Return whether the runs of each sample are enough for an interval."""
    sizes = [size for size in (comparison.n_a, comparison.n_b) if size]
    return min(sizes, default=0) >= MIN_INTERVAL_RUNS


def _decide_interval(rule: Rule, comparison: Comparison, bound: Bound) -> Verdict:
    low, high = comparison.low, comparison.high
    if not has_enough_runs(comparison) or math.isnan(low):
        return UNDECIDED
    lowest, highest = rule.limits(bound)
    if rule.contains_limits:
        return HOLDS if low <= lowest and highest <= high else FAILS
    is_inside = lowest <= low and high <= highest
    if rule.statistic == "probability":
        # Without a success, the interval begins at 0, and no probability above 0 is shown.
        is_inside = lowest < low and high < highest
    if is_inside:
        return HOLDS
    return FAILS if high < lowest or low > highest else UNDECIDED


def combine_verdicts(verdicts: list[Verdict]) -> Verdict:
    """Combine the verdicts of the parts of a claim. A claim without a part is not evaluated."""
    if not verdicts:
        return NOT_EVALUATED
    if FAILS in verdicts:
        return FAILS
    return HOLDS if set(verdicts) == {HOLDS} else UNDECIDED
