"""Verdicts: the words of all results, families of tests, and the rules that name a verdict."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from math import isnan
from typing import Final, Literal, TypeVar

from baldwinlab.analysis.statistics.comparisons import Comparison, Pairs
from baldwinlab.analysis.statistics.hypothesis_tests import holm
from baldwinlab.analysis.statistics.significance import (
    MIN_INTERVAL_RUNS,
    SIGNIFICANCE_LEVEL,
    PlannedTest,
    describe_required_runs,
    levels_of_tests,
    rank_test_runs,
    smallest_corrected_p,
)
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
# Words of all kinds of results: undecided, or a reason why nothing was decided.
UNDECIDED: Final = "undecided"
TOO_FEW_RUNS: Final = "too few runs"
NOT_MEASURABLE: Final = "not measurable"
NOT_MEASURED: Final = "not measured"
EQUAL: Final = "equal in every run"
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
    EQUAL: "=",
    UNSTABLE: "~",
}
"""Marks of the words. In small cells, a mark stands without its word."""

Difference = Literal["higher", "lower", "undecided", "too few runs"]
Verdict = Literal["holds", "does not hold", "undecided", "not evaluated"]
VERDICTS: Final[tuple[Verdict, ...]] = (HOLDS, UNDECIDED, FAILS, NOT_EVALUATED)
"""Verdicts on a claim, the best first."""

Key = TypeVar("Key", bound=Hashable)


def find_direction(numbers: Comparison | Pairs) -> int:
    """Return 1 if a is larger in the effect and in A12, -1 if a is smaller in both, else 0."""
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
    if isnan(comparison.effect):
        return UNDECIDED
    return HOLDS if lowest <= comparison.effect <= highest else FAILS


def _decide_survival(comparison: Comparison, p_holm: float) -> Verdict:
    """Decide the claim that a survives longer than b.

    The claim is undecided, unless the log-rank test is significant and the log-rank statistic has
    the sign of the effect. The effect is the difference of the restricted means.
    """
    if p_holm < SIGNIFICANCE_LEVEL and comparison.u * comparison.effect > 0:
        return HOLDS if comparison.effect > 0 else FAILS
    return UNDECIDED


def has_enough_runs(comparison: Comparison) -> bool:
    """Return whether each sample has enough runs for an interval. Size 0 means no sample b."""
    sizes = [size for size in (comparison.n_a, comparison.n_b) if size]
    return min(sizes, default=0) >= MIN_INTERVAL_RUNS


def _decide_interval(rule: Rule, comparison: Comparison, bound: Bound) -> Verdict:
    low, high = comparison.low, comparison.high
    if not has_enough_runs(comparison) or isnan(low):
        return UNDECIDED
    lowest, highest = rule.limits(bound)
    if rule.contains_limits:
        return HOLDS if low <= lowest and highest <= high else FAILS
    if rule.statistic == "probability" and (low == lowest or high == highest):
        # The limits are excluded: an interval that begins at 0 shows no probability above 0.
        return UNDECIDED
    return decide_limits(low, high, lowest, highest)


def decide_limits(low: float, high: float, lowest: float, highest: float) -> Verdict:
    """Decide the claim that a quantity is from `lowest` to `highest`, from its 95 % interval.

    The claim holds if the interval is in the limits, and fails if it is completely outside.
    """
    if lowest <= low and high <= highest:
        return HOLDS
    return FAILS if high < lowest or low > highest else UNDECIDED


def combine_verdicts(verdicts: list[Verdict]) -> Verdict:
    """Combine the verdicts of the parts of a claim. A claim without a part is not evaluated."""
    if not verdicts:
        return NOT_EVALUATED
    if FAILS in verdicts:
        return FAILS
    return HOLDS if set(verdicts) == {HOLDS} else UNDECIDED


@dataclass(frozen=True)
class FamilyTest:
    """A test of a family of tests, with the p-value before and after Holm's correction."""

    planned: PlannedTest
    # Uncorrected and corrected p-value.
    p: float
    p_holm: float
    # The smallest corrected p-value that the numbers of runs allow.
    smallest_p_holm: float
    # Level of the uncorrected p-value below which the test is significant.
    level: float

    @property
    def is_significant(self) -> bool:
        return self.p_holm < SIGNIFICANCE_LEVEL

    @property
    def has_too_few_runs(self) -> bool:
        """Whether no samples of these sizes can be significant."""
        return self.smallest_p_holm >= SIGNIFICANCE_LEVEL

    def find_direction(self, numbers: Comparison | Pairs) -> int:
        """Return 1 if a is significantly larger, -1 if a is significantly smaller, else 0."""
        return find_direction(numbers) if self.is_significant else 0

    def name_difference(self, numbers: Comparison | Pairs) -> Difference:
        """Return "higher" or "lower" for a significant difference, else why none is shown."""
        undecided: Difference = TOO_FEW_RUNS if self.has_too_few_runs else UNDECIDED
        names: Mapping[int, Difference] = {1: HIGHER, 0: undecided, -1: LOWER}
        return names[self.find_direction(numbers)]

    @property
    def required_runs(self) -> int | None:
        """The number of runs that would decide the test if the effect is the observed one."""
        return rank_test_runs(self.planned, self.p, self.level)

    def explain(self, low: float, high: float, *, is_decided: bool) -> str:
        """Explain the verdict, given the interval of the effect: see `explain_verdict`."""
        required = "" if is_decided else describe_required_runs(self.required_runs)
        return explain_verdict(low, high, self.p_holm, required)


def correct_family(tests: Mapping[Key, tuple[PlannedTest, float]]) -> dict[Key, FamilyTest]:
    """Correct the p-values of a family of tests. A test without a p-value is left out."""
    defined = {key: test for key, test in tests.items() if not isnan(test[1])}
    p_holm = holm([p for _, p in defined.values()])
    smallest = smallest_corrected_p([planned for planned, _ in defined.values()])
    levels = levels_of_tests(p_holm)
    columns = zip(p_holm.tolist(), smallest.tolist(), levels.tolist(), strict=True)
    return {
        key: FamilyTest(planned, p, *numbers)
        for (key, (planned, p)), numbers in zip(defined.items(), columns, strict=True)
    }


def explain_verdict(low: float, high: float, p_holm: float, required_runs: str = "") -> str:
    """Explain a verdict: which number decides, and how many runs an undecided test needs.

    The interval is of a single comparison. The verdict uses the p-value corrected for all
    comparisons, and can be undecided although the interval excludes 0. A rank test can also be
    significant although the interval of the medians includes 0. `required_runs` is the result of
    `describe_required_runs`. The result is "" if nothing needs an explanation.
    """
    notes = [required_runs] if required_runs else []
    excludes_zero = low > 0 or high < 0
    has_interval = not (isnan(low) or isnan(p_holm))
    if has_interval and excludes_zero != (p_holm < SIGNIFICANCE_LEVEL):
        notes.insert(
            0, f"the corrected p {p_holm:.2g} decides, not the interval of this comparison alone"
        )
    return "; ".join(notes)
