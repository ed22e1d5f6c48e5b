"""Rules of claims: which number of a comparison decides a claim, and the limits of this number."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, Final, Literal, NamedTuple

# A number; a pair of numbers for a rule with two bounds; None for a rule without a bound.
Bound = float | tuple[float, float] | None
Kind = Literal["direction", "survival", "interval", "number"]
Statistic = Literal["median", "mean", "minimum", "maximum", "probability"]


class Rule(NamedTuple):
    """A rule that decides the comparison of a claim.

    The kinds of rules:

    - direction: a rank test must be significant, in the direction of `sign`;
    - survival: a log-rank test must be significant, and `a` must survive longer;
    - interval: the 95 % interval of the effect must be in the limits;
    - number: a statistic of all runs must be in the limits.
    """

    kind: Kind
    # Description, with "{bound}" for the bound.
    text: str
    # 1 if `a` must be higher than `b`, -1 if it must be lower, 0 for other kinds.
    sign: int = 0
    # Number of values in the bound: 0, 1 or 2.
    n_bounds: int = 0
    # Returns the smallest and the largest number with which the claim holds, from the bound.
    limits: Callable[[Any], tuple[float, float]] = lambda _: (-math.inf, math.inf)
    statistic: Statistic = "median"
    # Whether the condition `a` is compared with the condition `b`, not with the bound.
    has_reference: bool = False
    # True: the interval must contain the limits. False: the limits must contain the interval.
    contains_limits: bool = False


def _limit_below(bound: float) -> tuple[float, float]:
    return bound, math.inf


def _limit_above(bound: float) -> tuple[float, float]:
    return -math.inf, bound


RULES: Final[Mapping[str, Rule]] = {
    "greater": Rule(
        "direction",
        "Holds if, in every comparison, the corrected p is below 0.05 and the first condition is "
        "higher in the median and in A12. Does not hold if it is significantly lower in any "
        "comparison. Otherwise undecided.",
        sign=1,
        has_reference=True,
    ),
    "lower": Rule(
        "direction",
        "Holds if, in every comparison, the corrected p is below 0.05 and the first condition is "
        "lower in the median and in A12. Does not hold if it is significantly higher in any "
        "comparison. Otherwise undecided.",
        sign=-1,
        has_reference=True,
    ),
    "close": Rule(
        "interval",
        "Holds if the 95 % interval of the difference is within {bound} of 0. Does not hold if the "
        "interval is completely outside. Otherwise, and with fewer than 6 runs, undecided.",
        n_bounds=1,
        limits=lambda bound: (-bound, bound),
        has_reference=True,
    ),
    "survives_longer": Rule(
        "survival",
        "Holds if, in every comparison, the corrected p of the log-rank test is below 0.05 and the "
        "first condition survives longer, also in the restricted mean. Does not hold if it "
        "survives significantly shorter in any comparison. Otherwise undecided. Runs that survive "
        "to the end are censored.",
        has_reference=True,
    ),
    "zero": Rule(
        "number",
        "Holds if no agent ate an item in any run and any generation. Otherwise it does not hold.",
        limits=lambda _: (0.0, 0.0),
        statistic="maximum",
    ),
    "at_least": Rule(
        "interval",
        "Holds if the 95 % interval of the median over runs is at or above {bound}. Does not hold "
        "if the interval is completely below. Otherwise, and with fewer than 6 runs, undecided.",
        n_bounds=1,
        limits=_limit_below,
    ),
    "within": Rule(
        "interval",
        "Holds if the 95 % interval of the median over runs is in {bound}. Does not hold if the "
        "interval is completely outside. Otherwise, and with fewer than 6 runs, undecided.",
        n_bounds=2,
        limits=tuple,
    ),
    "mean_within": Rule(
        "number",
        "Holds if the mean over runs is in {bound}. Otherwise it does not hold.",
        n_bounds=2,
        limits=tuple,
        statistic="mean",
    ),
    "mean_at_most": Rule(
        "number",
        "Holds if the mean over runs is at most {bound}. Otherwise it does not hold.",
        n_bounds=1,
        limits=_limit_above,
        statistic="mean",
    ),
    "every_at_most": Rule(
        "number",
        "Holds if the value is at most {bound} in every run. Otherwise it does not hold.",
        n_bounds=1,
        limits=_limit_above,
        statistic="maximum",
    ),
    "every_at_least": Rule(
        "number",
        "Holds if the value is at least {bound} in every run. Otherwise it does not hold.",
        n_bounds=1,
        limits=_limit_below,
        statistic="minimum",
    ),
    "probability_above": Rule(
        "interval",
        "Holds if the 95 % Clopper-Pearson interval of the probability is above {bound}. Does not "
        "hold if the interval is below. Otherwise, and with fewer than 6 runs, undecided.",
        n_bounds=1,
        limits=_limit_below,
        statistic="probability",
    ),
    "probability_below": Rule(
        "interval",
        "Holds if the 95 % Clopper-Pearson interval of the probability is below {bound}. Does not "
        "hold if the interval is above. Otherwise, and with fewer than 6 runs, undecided.",
        n_bounds=1,
        limits=_limit_above,
        statistic="probability",
    ),
    "probability_equals": Rule(
        "interval",
        "Holds if the 95 % Clopper-Pearson interval of the probability contains {bound}, does not "
        "hold otherwise, and is undecided with fewer than 6 runs.",
        n_bounds=1,
        limits=lambda bound: (bound, bound),
        statistic="probability",
        contains_limits=True,
    ),
}
