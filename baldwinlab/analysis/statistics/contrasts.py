"""Compare the conditions of a study, such as controls with the condition that they control for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import groupby
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from baldwinlab.analysis import statistics
from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.statistics.rules import SIGNIFICANT, UNDECIDED, direction
from baldwinlab.analysis.statistics.sample_sizes import (
    TOO_FEW,
    Design,
    describe_too_few,
    smallest_corrected,
)
from baldwinlab.experiment.factors import Factors, of_study

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
    """The comparison of a condition with its reference, in one measure.

    Attributes
    ----------
    condition, reference : str
        Names of the conditions.
    measure : str
        One of `MEASURES`.
    numbers : Comparison
        The comparison of the condition with the reference.
    p_holm : float
        The p-value, corrected for all comparisons of the study.
    smallest_p_holm : float
        The smallest corrected p-value that the numbers of runs allow.
    """

    condition: str
    reference: str
    measure: str
    numbers: statistics.Comparison
    p_holm: float
    smallest_p_holm: float

    @property
    def verdict(self) -> str:
        """A significant difference is "higher" or "lower", else "undecided" or "too few runs"."""
        sign = direction(self.numbers, self.p_holm)
        if sign:
            return "higher" if sign > 0 else "lower"
        return TOO_FEW if self.smallest_p_holm >= SIGNIFICANT else UNDECIDED

    def row(self) -> dict[str, Any]:
        """Return the comparison as a row of a table.

        Returns
        -------
        dict
            The values, with the keys `COLUMNS`.
        """
        names = {
            "condition_a": self.condition,
            "condition_b": self.reference,
            "measure": self.measure,
        }
        return names | self.numbers._asdict() | {"p_holm": self.p_holm}


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
    """

    pairing: str
    last: int
    rows: tuple[Contrast, ...]

    @property
    def by_pair(self) -> list[list[Contrast]]:
        """The comparisons, grouped by the two conditions."""
        pairs = groupby(self.rows, key=lambda row: (row.condition, row.reference))
        return [list(rows) for _, rows in pairs]

    @property
    def too_few(self) -> str:
        """A sentence about runs that are too few for a verdict, or an empty string."""
        return describe_too_few([Design(row.numbers.n_a, row.numbers.n_b) for row in self.rows])


def final_values(dataset: xr.Dataset, last: int = 10) -> xr.Dataset:
    """Average the measures over the last generations of each run.

    Parameters
    ----------
    dataset
        Dataset as `open_runs` returns it, with `energy` as (condition, run, generation, agent).
    last
        Number of final generations, at least 1.

    Returns
    -------
    xarray.Dataset
        The averages of `MEASURES`, (condition, run).

    Raises
    ------
    ValueError
        If `last` is below 1.
    """
    values = {measure: fitness.final(dataset, measure, last) for measure in MEASURES}
    return xr.Dataset(values).reset_coords(drop=True)


def compare_conditions(dataset: xr.Dataset, last: int = 10, baseline: str = "") -> Contrasts:
    """Compare the conditions of a dataset.

    Parameters
    ----------
    dataset
        Dataset as `open_runs` returns it.
    last
        Number of final generations over which each run is averaged, at least 1.
    baseline
        The condition with which all others are compared; see `references` for the default.

    Returns
    -------
    Contrasts
        The comparisons, in the order of the study.

    Raises
    ------
    ValueError
        If `last` is below 1.
    """
    return compare_finals(final_values(dataset, last), of_study(dataset), last, baseline)


def compare_finals(
    finals: xr.Dataset,
    factors: Mapping[str, Factors],
    last: int,
    baseline: str = "",
) -> Contrasts:
    """Compare every condition that has runs with its reference.

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

    Returns
    -------
    Contrasts
        The comparisons, with p-values corrected for all of them.
    """
    present = [name for name in factors if bool(finals["mean"].sel(condition=name).notnull().any())]
    pairs = references({name: factors[name] for name in present}, baseline)
    tests = [(*pair, measure) for pair in pairs.items() for measure in MEASURES]
    numbers = [
        _compare_runs(finals[measure], condition, reference)
        for condition, reference, measure in tests
    ]
    corrected = statistics.holm([comparison.p for comparison in numbers])
    smallest = smallest_corrected([Design(sizes.n_a, sizes.n_b) for sizes in numbers])
    rows = zip(tests, numbers, corrected.tolist(), smallest.tolist(), strict=True)
    return Contrasts(
        describe_pairing(pairs, factors),
        last,
        tuple(Contrast(*test, *values) for test, *values in rows),
    )


def references(factors: Mapping[str, Factors], baseline: str = "") -> dict[str, str]:
    """Return the condition with which each condition is compared.

    It is the baseline if one is given. Otherwise it is the first condition on the same map, and in
    a multiverse under the same variant. A condition that is alone on its map, or has no map, is
    compared with the first condition of all.

    Parameters
    ----------
    factors
        The factors of each condition, in the order of the study.
    baseline
        The name of a condition, or an empty string.

    Returns
    -------
    dict
        The reference of each condition. A condition without a reference is missing.
    """
    if baseline:
        return {name: baseline for name in factors if name != baseline}
    on_map: dict[Factors, list[str]] = {}
    for name, levels in factors.items():
        group = levels._replace(learner="" if levels.map else name)
        on_map.setdefault(group, []).append(name)
    groups = [names for names in on_map.values() if len(names) > 1]
    first = {name: names[0] for names in groups for name in names}
    pairs = {name: first.get(name, next(iter(factors))) for name in factors}
    return {name: reference for name, reference in pairs.items() if reference != name}


def describe_pairing(pairs: Mapping[str, str], factors: Mapping[str, Factors]) -> str:
    """Describe which conditions are compared.

    Parameters
    ----------
    pairs
        The reference of each condition, as `references` returns it.
    factors
        The factors of each condition.

    Returns
    -------
    str
        One or two sentences. Empty if no condition is compared.
    """
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


def planned_designs(factors: Mapping[str, Factors], runs: int, baseline: str = "") -> list[Design]:
    """Return the tests that a study of these conditions will make.

    Parameters
    ----------
    factors
        The factors of each condition, in the order of the study.
    runs
        The number of runs of each condition.
    baseline
        The condition with which all others are compared; see `references` for the default.

    Returns
    -------
    list of Design
        The tests.
    """
    return [Design(runs, runs)] * (len(references(factors, baseline)) * len(MEASURES))


def _compare_runs(values: xr.DataArray, condition: str, reference: str) -> statistics.Comparison:
    samples = (values.sel(condition=name).dropna("run").values for name in (condition, reference))
    return statistics.compare(*(np.asarray(sample, np.float64) for sample in samples))
