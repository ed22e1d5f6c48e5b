"""Curves of each species, generation by generation.

The functions take a dataset with `energy` and `species` as (..., run, generation, agent). Missing
generations are NaN. A run that stopped has the value of its last generation in the later ones.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

import xarray as xr

from baldwinlab.analysis.statistics.fitness import hold_last

SPECIES_CURVES: Final = ("mean", "share", "size", "survivors")
"""Names of the curves of a species: mean fitness, share of agents with fitness above 0, number of
agents, and number of agents that are alive at the end of a lifetime."""


def compute_species_curves(
    data: xr.Dataset, names: Sequence[str], curves: Iterable[str] = SPECIES_CURVES
) -> dict[str, dict[str, xr.DataArray]]:
    """Compute curves of each species.

    Parameters
    ----------
    data
        Dataset with `energy`, `species` and, for the survivors, `alive`.
    names
        Names of the species, in the order of their indices.
    curves
        Names of `SPECIES_CURVES`.

    Returns
    -------
    dict of str to dict of str to xarray.DataArray
        Curves without the dimension `agent`, by name of the curve and of the species. The fitness
        of a species without agents is NaN.
    """
    return {
        curve: {
            name: hold_last(_compute_curve(data, curve, index)) for index, name in enumerate(names)
        }
        for curve in curves
    }


def _compute_curve(data: xr.Dataset, curve: str, index: int) -> xr.DataArray:
    """Return a curve of the species with an index."""
    is_member = data["species"] == index
    energy = data["energy"].where(is_member)
    if curve == "mean":
        return energy.mean("agent")
    if curve == "share":
        is_above = (energy > 0).where(energy.notnull())
        return is_above.mean("agent").assign_attrs(valid_max=1.0)
    counted = is_member if curve == "size" else data["alive"].where(is_member)
    has_data = data["species"].notnull().any("agent")
    return counted.sum("agent").where(has_data)


def compute_species_shares(data: xr.Dataset, names: Sequence[str]) -> xr.Dataset:
    """Compute the share of each species in the agents of a generation.

    Parameters
    ----------
    data
        Dataset with `species`.
    names
        Names of the species, in the order of their indices.

    Returns
    -------
    xarray.Dataset
        A variable for each species, 0 to 1, without the dimension `agent`.
    """
    species = data["species"]
    n_agents = species.notnull().sum("agent")
    shares = {
        name: hold_last((species == index).sum("agent") / n_agents.where(n_agents > 0))
        for index, name in enumerate(names)
    }
    meanings = {name: f"share of agents of the species {name}" for name in names}
    return xr.Dataset(
        {
            name: share.assign_attrs(long_name=meanings[name], valid_max=1.0)
            for name, share in shares.items()
        }
    )
