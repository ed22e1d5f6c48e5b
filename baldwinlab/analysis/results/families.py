"""Families of tests: the correction of their p-values, and the tests with too few runs."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from math import isnan
from typing import TypeVar

from baldwinlab.analysis.results.verdicts import (
    HIGHER,
    LOWER,
    TOO_FEW_RUNS,
    UNDECIDED,
    Difference,
    find_direction,
)
from baldwinlab.analysis.statistics.comparisons import Comparison, Pairs
from baldwinlab.analysis.statistics.power import (
    describe_required_runs,
    levels_of_tests,
    rank_test_runs,
)
from baldwinlab.analysis.statistics.rank_tests import holm
from baldwinlab.analysis.statistics.sample_sizes import (
    SIGNIFICANCE_LEVEL,
    PlannedTest,
    smallest_corrected_p,
)

Key = TypeVar("Key", bound=Hashable)


@dataclass(frozen=True)
class FamilyTest:
    """A test of a family whose p-values are corrected by Holm's method."""

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
        """Whether no values of these sizes can be significant."""
        return self.smallest_p_holm >= SIGNIFICANCE_LEVEL

    def find_direction(self, numbers: Comparison | Pairs) -> int:
        """Return 1 or -1 if a is significantly larger or smaller, else 0."""
        return find_direction(numbers) if self.is_significant else 0

    def name_difference(self, numbers: Comparison | Pairs) -> Difference:
        """Return the direction of a significant difference, or why none is shown."""
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
    """Explain a verdict: the number that decides, and the runs that an undecided one needs.

    An interval is that of a single comparison. The verdict uses the p-value corrected for all
    comparisons, so it can be undecided although the interval excludes 0. A rank test can also be
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
