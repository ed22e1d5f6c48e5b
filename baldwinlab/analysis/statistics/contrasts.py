"""Compare the conditions of a study, for example a condition with its control."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import groupby
from math import isnan
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from baldwinlab.analysis import statistics
from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.statistics.power import (
    describe_required_runs,
    level_of_next_test,
    rank_test_runs,
)
from baldwinlab.analysis.statistics.rules import SIGNIFICANCE_LEVEL, UNDECIDED, direction
from baldwinlab.analysis.statistics.sample_sizes import (
    TOO_FEW_RUNS,
    PlannedTest,
    describe_too_few,
    smallest_corrected_p,
)
from baldwinlab.experiment.factors import Factors, read_factors

COMPARED_MEASURES = ("mean", "best")
COMPARISON_COLUMNS = (
    "condition_a",
    "condition_b",
    "measure",
    *statistics.Comparison._fields[:-1],
    "p_holm",
    "a12",
    "verdict",
)
"""The columns of a comparison in every table."""


class Contrast(NamedTuple):
    """The comparison of a condition with its reference, in one measure.

    Attributes
    ----------
    condition, reference : str
        Names of the conditions.
    measure : str
        One of `COMPARED_MEASURES`.
    outcome : str
        Name of the compared quantity, from `name_outcome`.
    numbers : Comparison
        The comparison of the condition with the reference.
    p_holm : float
        The p-value, corrected for all comparisons of the study.
    smallest_p_holm : float
        The smallest corrected p-value that the numbers of runs allow.
    level : float
        Level of the uncorrected p-value below which the comparison would be significant.
    """

    condition: str
    reference: str
    measure: str
    outcome: str
    numbers: statistics.Comparison
    p_holm: float
    smallest_p_holm: float
    level: float

    @property
    def verdict(self) -> str:
        """The verdict: "higher", "lower", or if not significant, "undecided" or "too few runs"."""
        sign = direction(self.numbers, self.p_holm)
        if sign:
            return "higher" if sign > 0 else "lower"
        return TOO_FEW_RUNS if self.smallest_p_holm >= SIGNIFICANCE_LEVEL else UNDECIDED

    @property
    def required_runs(self) -> int | None:
        """The number of runs that would decide an undecided comparison, if any.

        The effect is assumed to be the observed one.
        """
        if self.verdict in ("higher", "lower"):
            return None
        test = PlannedTest(self.numbers.n_a, self.numbers.n_b)
        return rank_test_runs(test, self.numbers.p, self.level)

    @property
    def note(self) -> str:
        """The number that decides, if needed, and the runs that an undecided comparison needs."""
        is_decided = self.verdict in ("higher", "lower")
        required = "" if is_decided else describe_required_runs(self.required_runs)
        return explain_verdict(self.numbers.low, self.numbers.high, self.p_holm, required)

    def row(self) -> dict[str, Any]:
        """Return the comparison as a row of a table, with the keys `COMPARISON_COLUMNS`."""
        labels = {
            "condition_a": self.condition,
            "condition_b": self.reference,
            "measure": self.measure,
        }
        result = {"p_holm": self.p_holm, "verdict": self.verdict}
        return labels | self.numbers._asdict() | result


@dataclass(frozen=True)
class Contrasts:
    """All comparisons of a study, which are one family of tests.

    Attributes
    ----------
    pairing : str
        A sentence that states which conditions are compared.
    last : int
        Number of final generations over which a run is averaged.
    rows : tuple of Contrast
        The comparisons.
    instruction : str
        A sentence that says how to add runs, with "{runs}" for their number.
    """

    pairing: str
    last: int
    rows: tuple[Contrast, ...]
    instruction: str = ""

    @property
    def rows_by_pair(self) -> list[list[Contrast]]:
        """The comparisons, grouped by the two conditions."""
        pairs = groupby(self.rows, key=lambda row: (row.condition, row.reference))
        return [list(rows) for _, rows in pairs]

    @property
    def has_common_reference(self) -> bool:
        """Whether all conditions are compared with the same condition, which `pairing` names."""
        return len({row.reference for row in self.rows}) == 1

    @property
    def too_few(self) -> str:
        """The sentences about runs that are too few for a verdict, or an empty string."""
        tests = [PlannedTest(row.numbers.n_a, row.numbers.n_b) for row in self.rows]
        return describe_too_few(tests, instruction=self.instruction)


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


def final_values(dataset: xr.Dataset, last: int = 10) -> xr.Dataset:
    """Average the measures over the last generations of each run, (condition, run)."""
    values = {measure: fitness.final(dataset, measure, last) for measure in COMPARED_MEASURES}
    attributes = {"outcome": fitness.outcome(dataset)}
    return xr.Dataset(values, attrs=attributes).reset_coords(drop=True)


def compare_conditions(dataset: xr.Dataset, last: int = 10, baseline: str = "") -> Contrasts:
    """Compare the conditions of a dataset: `find_references` explains the baseline."""
    return compare_final_values(final_values(dataset, last), read_factors(dataset), last, baseline)


def compare_final_values(
    finals: xr.Dataset,
    factors: Mapping[str, Factors],
    last: int,
    baseline: str = "",
) -> Contrasts:
    """Compare every condition that has runs with its reference, by the values of `final_values`."""
    has_runs = finals["mean"].notnull().any("run")
    factors_with_runs = {
        name: levels for name, levels in factors.items() if bool(has_runs.sel(condition=name))
    }
    pairs = find_references(factors_with_runs, baseline)
    outcome = fitness.outcome(finals)
    tests = [(*pair, measure, outcome) for pair in pairs.items() for measure in COMPARED_MEASURES]
    numbers = [
        _compare_runs(finals[measure], condition, reference)
        for condition, reference, measure, _ in tests
    ]
    corrected = statistics.holm([comparison.p for comparison in numbers])
    smallest = smallest_corrected_p(
        [PlannedTest(comparison.n_a, comparison.n_b) for comparison in numbers]
    )
    levels = [level_of_next_test(corrected)] * len(tests)
    # Each row has the fields of a `Contrast`, of which the first four are a test.
    rows = zip(tests, numbers, corrected.tolist(), smallest.tolist(), levels, strict=True)
    return Contrasts(
        pairing=describe_pairing(pairs, factors),
        last=last,
        rows=tuple(Contrast(*test, *values) for test, *values in rows),
    )


def find_references(factors: Mapping[str, Factors], baseline: str = "") -> dict[str, str]:
    """Return the condition with which each condition is compared, except for the references.

    Every condition is compared with the baseline, if a baseline is given. Otherwise it is compared
    with the first condition on the same map, and in a multiverse under the same variant. A
    condition that is alone on its map, or has no map, is compared with the first condition of the
    study.
    """
    if baseline:
        return {name: baseline for name in factors if name != baseline}
    names_by_map: dict[Factors, list[str]] = {}
    for name, levels in factors.items():
        # Equal for conditions that share all factors but the learner. Without a map, the name makes
        # the group unique.
        group = levels._replace(learner="" if levels.map else name)
        names_by_map.setdefault(group, []).append(name)
    groups = [names for names in names_by_map.values() if len(names) > 1]
    first_on_map = {name: names[0] for names in groups for name in names}
    pairs = {name: first_on_map.get(name, next(iter(factors))) for name in factors}
    return {name: reference for name, reference in pairs.items() if reference != name}


def describe_pairing(pairs: Mapping[str, str], factors: Mapping[str, Factors]) -> str:
    """Describe which conditions are compared, or return "" without a comparison."""
    baselines = set(pairs.values())
    if len(baselines) < 2:
        return "".join(f"Each condition is compared with {name}." for name in baselines)
    across_maps = [
        name for name, reference in pairs.items() if factors[name].map != factors[reference].map
    ]
    exceptions = ""
    if across_maps:
        rule = "A condition that is alone on its map, or has no map, is compared with"
        exceptions = f" {rule} {pairs[across_maps[0]]}: {', '.join(across_maps)}."
    return f"Each condition is compared with the first condition on its map.{exceptions}"


def planned_tests(
    factors: Mapping[str, Factors], runs: int, baseline: str = ""
) -> list[PlannedTest]:
    """Return the tests that a study with the given number of runs per condition will make."""
    n_tests = len(find_references(factors, baseline)) * len(COMPARED_MEASURES)
    return [PlannedTest(runs, runs)] * n_tests


def _compare_runs(values: xr.DataArray, condition: str, reference: str) -> statistics.Comparison:
    a = values.sel(condition=condition).dropna("run").values
    b = values.sel(condition=reference).dropna("run").values
    return statistics.compare(np.asarray(a, np.float64), np.asarray(b, np.float64))
