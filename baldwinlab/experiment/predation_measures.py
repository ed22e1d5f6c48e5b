"""Measures of each species of a run, in the last ten generations."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from typing import TYPE_CHECKING, Final

from baldwinlab.core.measures import Measure

# Commands that show presets do not load xarray, which takes time.
if TYPE_CHECKING:
    import xarray as xr

LAST_GENERATIONS: Final = 10
"""Number of generations at the end of a run over which a measure is averaged."""


def average_species(variable: str, species: int, runs: xr.Dataset) -> xr.DataArray:
    """Return the mean of a variable over the agents of a species at the end of runs, [run].

    It is NaN for a run without agents of the species.
    """
    final_values = runs[[variable, "species"]].isel(generation=slice(-LAST_GENERATIONS, None))
    return (
        final_values[variable]
        .where(final_values["species"] == species)
        .mean(["generation", "agent"])
    )


def make_predation_measures(names: Iterable[str], prey: Iterable[str]) -> dict[str, Measure]:
    """Return the fitness of each species, and the survival of each prey, as measures by name.

    `names`: names of the species, in the order of their indices.
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
