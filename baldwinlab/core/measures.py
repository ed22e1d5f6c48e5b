"""Measures: numbers that summarize a run, for figures and for claims of papers."""

from __future__ import annotations

from collections.abc import Callable
from math import nan
from typing import NamedTuple

from baldwinlab.core.deferred import xr


class Measure(NamedTuple):
    """Number that summarizes a run, for figures and for claims of papers.

    Attributes
    ----------
    meaning : str
        Description with unit.
    of : Callable
        Function that returns an array (run) from the stored runs, a dataset (run, generation,
        agent). NaN: no value. All runs of the dataset have the same number of generations, so
        its last generation is the last one of each run.
    censored : Callable or None
        For a duration: function that returns a bool array (run) from the stored runs. True: the
        duration is longer than the observed value.
    """

    meaning: str
    of: Callable[[xr.Dataset], xr.DataArray]
    censored: Callable[[xr.Dataset], xr.DataArray] | None = None


def first_generation(condition: xr.DataArray, otherwise: float = nan) -> xr.DataArray:
    """Return the first generation in which a condition is true, or `otherwise`."""
    return condition.argmax("generation").where(condition.any("generation"), otherwise)


def measure_runs(function: Callable[[xr.Dataset], xr.DataArray], runs: xr.Dataset) -> xr.DataArray:
    """Call the function of a measure once for all runs of the same number of generations.

    A run that stopped early has no data in the later generations of the dataset. A function that
    reads the last generations would return NaN for it.
    """
    # This module loads NumPy, which commands that only print do not need.
    from baldwinlab.core.variables import GENERATION_COUNT

    if GENERATION_COUNT not in runs.coords or not runs.sizes["run"]:
        return function(runs)
    counts = runs[GENERATION_COUNT].values
    values = []
    for count in sorted(set(counts.tolist())):
        has_generation = runs["generation"].values < count
        group = runs.isel(run=counts == count, generation=has_generation)
        values.append(function(group).reset_coords(drop=True))
    return xr.concat(values, "run").sel(run=runs["run"])
