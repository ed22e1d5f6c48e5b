"""Compare the conditions of a study, for example a condition with its control."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from baldwinlab.analysis import statistics
from baldwinlab.analysis.results.verdicts import FamilyTest, correct_family
from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.statistics.significance import PlannedTest, describe_too_few
from baldwinlab.experiment.conditions import Factors, describe_map

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
"""The columns of a comparison in every table. The last field, `a12`, follows `p_holm`."""


class Contrast(NamedTuple):
    """The comparison of a condition with its reference, in one measure."""

    condition: str
    reference: str
    measure: str  # One of `COMPARED_MEASURES`.
    outcome: str  # Name of the compared quantity, from `name_outcome`.
    numbers: statistics.Comparison
    test: FamilyTest  # The p-value is corrected for all comparisons of the study.

    @property
    def verdict(self) -> str:
        """The verdict: "higher", "lower", or if not significant, "undecided" or "too few runs"."""
        return self.test.name_difference(self.numbers)

    @property
    def is_decided(self) -> bool:
        """Whether the verdict is "higher" or "lower"."""
        return self.test.find_direction(self.numbers) != 0

    @property
    def required_runs(self) -> int | None:
        """The number of runs that would decide the comparison if the effect is the observed one.

        None if the comparison is decided, or if no realistic number of runs would decide it.
        """
        return None if self.is_decided else self.test.required_runs

    @property
    def note(self) -> str:
        """Phrases: why the corrected p-value decides, and how many runs would decide. Can be ""."""
        numbers = self.numbers
        return self.test.explain(numbers.low, numbers.high, is_decided=self.is_decided)

    def row(self) -> dict[str, Any]:
        """Return the comparison as a row of a table, with the keys `COMPARISON_COLUMNS`."""
        labels = {
            "condition_a": self.condition,
            "condition_b": self.reference,
            "measure": self.measure,
        }
        result = {"p_holm": self.test.p_holm, "verdict": self.verdict}
        return labels | self.numbers._asdict() | result


@dataclass(frozen=True)
class Contrasts:
    """All comparisons of a study, which are one family of tests."""

    pairing: str  # A sentence that states which conditions are compared.
    last: int  # Number of final generations over which a run is averaged.
    rows: tuple[Contrast, ...]
    instruction: str = ""  # How to add runs, with "{runs}" for the number of runs.
    factors: Mapping[str, Factors] = field(default_factory=dict)  # By condition.
    # Whether the agents of a condition learn. Empty if unknown.
    learns: Mapping[str, bool] = field(default_factory=dict)

    @property
    def has_common_reference(self) -> bool:
        """Whether all conditions are compared with the same condition, which `pairing` names."""
        return len({row.reference for row in self.rows}) == 1

    @property
    def too_few(self) -> str:
        """The sentences about runs that are too few for a verdict, or an empty string."""
        return describe_too_few(
            [row.test.planned for row in self.rows], instruction=self.instruction
        )


def final_values(dataset: xr.Dataset, last: int = 10) -> xr.Dataset:
    """Average `mean` and `best` over the last generations of each run, (condition, run)."""
    values = {measure: fitness.final(dataset, measure, last) for measure in COMPARED_MEASURES}
    attributes = {"outcome": fitness.outcome(dataset)}
    return xr.Dataset(values, attrs=attributes).reset_coords(drop=True)


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
    numbers = {
        (*pair, measure): _compare_runs(finals[measure], *pair)
        for pair in pairs.items()  # (condition, reference)
        for measure in COMPARED_MEASURES
    }
    family = correct_family(
        {key: (PlannedTest(row.n_a, row.n_b), row.p) for key, row in numbers.items()}
    )
    return Contrasts(
        pairing=describe_pairing(pairs, factors_with_runs),
        last=last,
        rows=tuple(Contrast(*key, outcome, numbers[key], test) for key, test in family.items()),
        factors=factors,
    )


def find_references(factors: Mapping[str, Factors], baseline: str = "") -> dict[str, str]:
    """Return the condition with which each condition is compared. A reference has no entry.

    If a baseline is given, it is the reference of all conditions. Otherwise a condition is compared
    with the first condition in the same world, and in a multiverse under the same variant. A
    condition that is alone in its world is not compared.
    """
    if baseline:
        return {name: baseline for name in factors if name != baseline}
    first: dict[tuple[str, ...], str] = {}  # Name by map, variant and world.
    pairs = {name: first.setdefault(levels.place, name) for name, levels in factors.items()}
    return {name: reference for name, reference in pairs.items() if reference != name}


def describe_pairing(pairs: Mapping[str, str], factors: Mapping[str, Factors]) -> str:
    """Describe which conditions are compared, and which are not because of their worlds."""
    baselines = dict.fromkeys(pairs.values())
    sentences = []
    if len(baselines) == 1:
        sentences = [f"Each condition is compared with {name}." for name in baselines]
    elif baselines:
        sentences = ["Each condition is compared with the first condition in its world."]
    across = [name for name in pairs if factors[name].place != factors[pairs[name]].place]
    if across:
        reference = _locate(pairs[across[0]], factors)
        conditions = ", ".join(_locate(name, factors) for name in across)
        sentences.append(f"Conditions in another world than {reference}: {conditions}.")
    alone = [name for name in factors if name not in (*pairs, *baselines)]
    if alone and len(factors) > 1:
        conditions = ", ".join(_locate(name, factors) for name in alone)
        sentences.append(
            f"Not compared, because no other condition is in the same world: {conditions}. The "
            f"option --baseline {next(iter(factors))} compares conditions in different worlds."
        )
    return " ".join(sentences)


def _locate(name: str, factors: Mapping[str, Factors]) -> str:
    """Return a condition with its map: "fading (map A)"."""
    map_name = factors[name].map
    return f"{name} ({describe_map(map_name)})" if map_name else name


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
