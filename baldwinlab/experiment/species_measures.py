"""Measures of runs with several species: curves of each species, and fixation."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

from baldwinlab.core.measures import Measure, first_generation
from baldwinlab.experiment.species import ACROSS

# Commands that show presets do not load xarray, which takes time.
if TYPE_CHECKING:
    import xarray as xr

# The charts of species in the lab, by curve, in this order.
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


def compute_first_species_share(runs: xr.Dataset) -> xr.DataArray:
    """Return the share of agents of the first species, [run, generation]; NaN without data."""
    species = runs["species"]
    has_data = species.notnull().all("agent")
    return (species == 0).mean("agent").where(has_data)


def compute_fixation(runs: xr.Dataset) -> xr.DataArray:
    """Return 1 for each run in which the first species is fixed at the end, else 0."""
    return (_final_share(runs) == 1) * 1.0


def is_unresolved(runs: xr.Dataset) -> xr.DataArray:
    """Return 1 for each run in which neither fixation nor loss of the first species occurred."""
    share = _final_share(runs)
    return ((share > 0) & (share < 1)) * 1.0


def count_generations_to_end(runs: xr.Dataset) -> xr.DataArray:
    """Return the generation in which the first species is lost or fixed; NaN if unresolved."""
    share = compute_first_species_share(runs)
    return first_generation((share == 0) | (share == 1))


def _final_share(runs: xr.Dataset) -> xr.DataArray:
    """Return the share of the first species in the last generation, [run]."""
    return compute_first_species_share(runs).isel(generation=-1)


SPECIES_MEASURES: Final[Mapping[str, Measure]] = {
    "fixation": Measure(
        "1 if all agents at the end of the run are of the first species, else 0", compute_fixation
    ),
    "unresolved": Measure(
        "1 if the first species is neither fixed nor lost at the end of the run, else 0",
        is_unresolved,
    ),
    "fixation-or-loss": Measure(
        "first generation in which the first species is fixed or lost", count_generations_to_end
    ),
}
