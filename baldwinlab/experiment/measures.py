"""Measures: numbers that summarize a run, for figures and for claims of papers.

A model declares its measures. Runs with several species have further measures: of fixation, and in
MiniWorld of each species. The lab shows curves of species.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from math import nan
from typing import Any, Final, NamedTuple

from baldwinlab.core.deferred import xr
from baldwinlab.experiment.species import ACROSS

LAST_GENERATIONS: Final = 10
"""Measures of a species are averaged over this number of generations at the end of a run."""


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
    """Return the first generation [run] in which a condition [run, generation] is true.

    `otherwise`: the value of a run without such a generation.
    """
    return condition.argmax("generation").where(condition.any("generation"), otherwise)


def measure_runs(function: Callable[[xr.Dataset], xr.DataArray], runs: xr.Dataset) -> xr.DataArray:
    """Call the function of a measure once for each group of runs with equal numbers of generations.

    In a dataset of all runs, a run that stopped early has no data in the later generations. A
    function that reads the last generations would then return NaN for this run.
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


def compute_first_species_share(runs: xr.Dataset) -> xr.DataArray:
    """Return the share of agents of the first species, [run, generation]; NaN without data."""
    species = runs["species"]
    has_data = species.notnull().all("agent")
    return (species == 0).mean("agent").where(has_data)


def is_unresolved(runs: xr.Dataset) -> xr.DataArray:
    """Return 1 for each run that ends with the first and other species, else 0 [run]."""
    share = _final_share(runs)
    return ((share > 0) & (share < 1)) * 1.0


def _final_share(runs: xr.Dataset) -> xr.DataArray:
    """Return the share of the first species in the last generation, [run]."""
    return compute_first_species_share(runs).isel(generation=-1)


SPECIES_MEASURES: Final[Mapping[str, Measure]] = {
    "fixation": Measure(
        "1 if all agents at the end of the run are of the first species, else 0",
        lambda runs: (_final_share(runs) == 1) * 1.0,
    ),
    "unresolved": Measure(
        "1 if the first species is neither fixed nor lost at the end of the run, else 0",
        is_unresolved,
    ),
    "fixation-or-loss": Measure(
        "first generation in which the first species is fixed or lost",
        lambda runs: first_generation(compute_first_species_share(runs).isin([0, 1])),
    ),
}


def average_species(variable: str, species: int, runs: xr.Dataset) -> xr.DataArray:
    """Return the mean of a variable over the agents of a species at the end of runs, [run].

    The mean is NaN for a run without agents of the species.
    """
    final_values = runs[[variable, "species"]].isel(generation=slice(-LAST_GENERATIONS, None))
    return (
        final_values[variable]
        .where(final_values["species"] == species)
        .mean(["generation", "agent"])
    )


def make_predation_measures(names: Iterable[str], prey: Iterable[str]) -> dict[str, Measure]:
    """Return the measures "NAME-fitness" of each species, and "NAME-survival" of each prey.

    `names`: names of the species, in the order of the indices of species. `prey`: eaten species.
    """
    eaten_species = {*prey}
    measures = {}
    for index, name in enumerate(names):
        measures[f"{name}-fitness"] = Measure(
            f"mean fitness of {name} in the last ten generations",
            partial(average_species, "energy", index),
        )
        if name in eaten_species:
            measures[f"{name}-survival"] = Measure(
                f"share of {name} that were alive at the end of a lifetime, last ten generations",
                partial(average_species, "alive", index),
            )
    return measures


# Title and axis of the charts of species in the lab, by curve, in the order of the charts.
SPECIES_CURVES: Final = {
    "mean": {"title": "Fitness of the average agent of each species", "axis": "fitness"},
    "share": {"title": "Share of agents of each species with fitness above 0", "axis": "share"},
    "size": {"title": "Agents of each species", "axis": "agents"},
    "composition": {"title": "Shares of the species", "axis": "share of the agents"},
    "survivors": {
        "title": "Agents of each species that are alive at the end of a lifetime",
        "axis": "agents",
    },
}


def list_species_curves(experiment: Any) -> list[str]:
    """Return the names of the curves of each species that the lab shows; none without species.

    "mean" is the mean fitness, and "share" the share of agents with fitness above 0. "size" is the
    number of agents, which is constant unless the species compete. "survivors" is the number of
    agents that are alive at the end of a lifetime, if agents can die.
    """
    if not experiment.population.species:
        return []
    curves = ["mean", "share"]
    if experiment.evolution.compete == ACROSS:
        curves.append("size")
    if experiment.model == "miniworld" and experiment.has_deaths:
        curves.append("survivors")
    return curves
