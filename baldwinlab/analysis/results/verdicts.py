"""Verdicts: the words of all results, and the rules of claims that name one of them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final, Literal

from baldwinlab.analysis.statistics.comparisons import Comparison, Pairs
from baldwinlab.analysis.statistics.sample_sizes import MIN_INTERVAL_RUNS, SIGNIFICANCE_LEVEL
from baldwinlab.papers.rules import Bound, Rule

# Verdicts on a claim.
HOLDS: Final = "holds"
FAILS: Final = "does not hold"
NOT_EVALUATED: Final = "not evaluated"
# Answers to a question about the direction of an effect. "no" is the opposite, or no effect.
YES: Final = "yes"
NO: Final = "no"
OPPOSITE: Final = "opposite"
EQUIVALENT: Final = "equivalent"
# Directions of a difference between two samples.
HIGHER: Final = "higher"
LOWER: Final = "lower"
# All of them can be undecided, or be replaced by the reason why nothing was decided.
UNDECIDED: Final = "undecided"
TOO_FEW_RUNS: Final = "too few runs"
NOT_MEASURABLE: Final = "not measurable"
NOT_MEASURED: Final = "not measured"
# Addition to a verdict that other runs could change.
UNSTABLE: Final = "unstable"
MARKS: Final[Mapping[str, str]] = {
    HOLDS: "✓",
    FAILS: "✗",
    NOT_EVALUATED: "–",
    YES: "✓",
    NO: "✗",
    OPPOSITE: "✗",
    EQUIVALENT: "=",
    HIGHER: "▲",
    LOWER: "▼",
    UNDECIDED: "?",
    TOO_FEW_RUNS: "?",
    NOT_MEASURABLE: "–",
    NOT_MEASURED: "–",
    UNSTABLE: "~",
}
"""Marks of the words, which also stand alone in small cells."""

Difference = Literal["higher", "lower", "undecided", "too few runs"]
Verdict = Literal["holds", "does not hold", "undecided", "not evaluated"]
VERDICTS: Final[tuple[Verdict, ...]] = (HOLDS, UNDECIDED, FAILS, NOT_EVALUATED)
"""Verdicts on a claim, the best first."""


def find_direction(numbers: Comparison | Pairs) -> int:
    """Return 1 or -1 if a is larger or smaller in the effect and in A12, else 0."""
    if numbers.effect > 0 and numbers.a12 > 0.5:
        return 1
    return -1 if numbers.effect < 0 and numbers.a12 < 0.5 else 0


def decide(rule: Rule, comparison: Comparison, p_holm: float, bound: Bound) -> Verdict:
    """Decide the comparison of a claim by a rule. See `papers.rules.Rule`."""
    if rule.kind == "direction":
        sign = find_direction(comparison) if p_holm < SIGNIFICANCE_LEVEL else 0
        verdicts: Mapping[int, Verdict] = {1: HOLDS, 0: UNDECIDED, -1: FAILS}
        return verdicts[rule.sign * sign]
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
