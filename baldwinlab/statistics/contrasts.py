"""Comparisons of the conditions of a study, such as controls and the condition they control for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import groupby
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from baldwinlab import statistics
from baldwinlab.factors import Factors, of_study
from baldwinlab.statistics import fitness
from baldwinlab.statistics.rules import SIGNIFICANT, UNDECIDED, direction
from baldwinlab.statistics.sample_sizes import TOO_FEW, Design, describe_too_few, smallest_corrected

MEASURES = ("mean", "best")
COLUMNS = (
    "condition_a",
    "condition_b",
    "measure",
    *statistics.Comparison._fields[:-1],
    "p_holm",
    "a12",
)
"""The columns that a comparison has in every table."""


class Contrast(NamedTuple):
    """A condition compared with another one, in one measure."""

    condition: str
    reference: str
    measure: str
    numbers: statistics.Comparison  # of the condition against the reference
    p_holm: float  # corrected for all comparisons of the study
    smallest_p_holm: float  # the smallest corrected p-value that the numbers of runs allow

    @property
    def verdict(self) -> str:
        """Higher or lower where the difference is significant; else undecided, or too few runs."""
        found = {1: "higher", -1: "lower"}.get(direction(self.numbers, self.p_holm))
        return found or (TOO_FEW if self.smallest_p_holm >= SIGNIFICANT else UNDECIDED)

    def row(self) -> dict[str, Any]:
        """Return its numbers by the names in `COLUMNS`."""
        names = {
            "condition_a": self.condition,
            "condition_b": self.reference,
            "measure": self.measure,
        }
        return names | self.numbers._asdict() | {"p_holm": self.p_holm}


@dataclass(frozen=True)
class Contrasts:
    """All comparisons of a study: one family of tests."""

    pairing: str  # which conditions are compared, in a sentence
    last: int  # generations over which a run is averaged
    rows: tuple[Contrast, ...]

    @property
    def by_pair(self) -> list[list[Contrast]]:
        """The comparisons of each two conditions together, one for each measure."""
        pairs = groupby(self.rows, key=lambda row: (row.condition, row.reference))
        return [list(rows) for _, rows in pairs]

    @property
    def too_few(self) -> str:
        """Whether the runs are too few for a verdict, in a sentence; "" where they are not."""
        return describe_too_few([Design(row.numbers.n_a, row.numbers.n_b) for row in self.rows])


def final_values(study: xr.Dataset, last: int = 10) -> xr.Dataset:
    """Average the measures over the last `last` generations of each run: (condition, run).

    Raises ValueError unless `last` is at least 1.
    """
    values = {measure: fitness.final(study, measure, last) for measure in MEASURES}
    return xr.Dataset(values).reset_coords(drop=True)


def compare_conditions(study: xr.Dataset, last: int = 10, baseline: str = "") -> Contrasts:
    """Compare the conditions of a dataset as `open_runs` returns it; see `compare_finals`."""
    return compare_finals(final_values(study, last), of_study(study), last, baseline)


def compare_finals(
    finals: xr.Dataset,
    factors: Mapping[str, Factors],
    last: int,
    baseline: str = "",
) -> Contrasts:
    """Compare every condition that has runs with its reference, or with `baseline`.

    Parameters
    ----------
    finals
        The values of `final_values`.
    factors
        The factors of each condition, in the order of the study.
    last
        The number of generations over which `finals` are averaged.
    baseline
        The condition with which all others are compared; see `references` for the default.
    """
    present = [name for name in factors if bool(finals["mean"].sel(condition=name).notnull().any())]
    pairs = references({name: factors[name] for name in present}, baseline)
    tests = [(name, other, measure) for name, other in pairs.items() for measure in MEASURES]
    found = [_compare_runs(finals[measure], name, other) for name, other, measure in tests]
    corrected = statistics.holm([numbers.p for numbers in found])
    smallest = smallest_corrected([Design(numbers.n_a, numbers.n_b) for numbers in found])
    rows = zip(tests, found, corrected.tolist(), smallest.tolist(), strict=True)
    return Contrasts(
        describe_pairing(pairs, factors),
        last,
        tuple(Contrast(*test, *numbers) for test, *numbers in rows),
    )


def references(factors: Mapping[str, Factors], baseline: str = "") -> dict[str, str]:
    """Return the condition with which each condition is compared.

    It is the baseline if one is given. Otherwise it is the first condition on the same map (of a
    multiverse, under the same variant), and for a condition that is alone on its map, or has no
    map, the first condition of all.
    """
    if baseline:
        return {name: baseline for name in factors if name != baseline}
    on_map: dict[Factors, list[str]] = {}
    for name, one in factors.items():
        on_map.setdefault(one._replace(learner="" if one.map else name), []).append(name)
    groups = [names for names in on_map.values() if len(names) > 1]
    first = {name: names[0] for names in groups for name in names}
    found = {name: first.get(name, next(iter(factors))) for name in factors}
    return {name: other for name, other in found.items() if other != name}


def describe_pairing(pairs: Mapping[str, str], factors: Mapping[str, Factors]) -> str:
    """Say in a sentence which conditions are compared; "" where none are."""
    used = set(pairs.values())
    if len(used) < 2:
        return "".join(f"Each condition is compared with {name}." for name in used)
    alone = [name for name, other in pairs.items() if factors[name].map != factors[other].map]
    others = ""
    if alone:
        reason = "A condition that is alone on its map, or has no map, is compared with"
        others = f" {reason} {pairs[alone[0]]}: {', '.join(alone)}."
    return f"Each condition is compared with the first condition on its map.{others}"


def planned_designs(factors: Mapping[str, Factors], runs: int, baseline: str = "") -> list[Design]:
    """Return the tests that a study of these conditions will make with so many runs of each."""
    return [Design(runs, runs)] * (len(references(factors, baseline)) * len(MEASURES))


def _compare_runs(values: xr.DataArray, condition: str, other: str) -> statistics.Comparison:
    samples = (values.sel(condition=name).dropna("run").values for name in (condition, other))
    return statistics.compare(*(np.asarray(sample, np.float64) for sample in samples))
