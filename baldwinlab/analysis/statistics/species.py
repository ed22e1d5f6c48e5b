"""Curves of each species, generation by generation.

The functions take a dataset with `energy` and `species` as (..., run, generation, agent). Missing
generations are NaN. A run that stopped has the value of its last generation in the later ones.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import xarray as xr

from baldwinlab.analysis.statistics.fitness import hold_last


def compute_species_curves(
    data: xr.Dataset, names: Sequence[str], curves: Iterable[str]
) -> dict[str, dict[str, xr.DataArray]]:
    """Compute curves of each species.

    Parameters
    ----------
    data
        Dataset with `energy`, `species` and, for the survivors, `alive`.
    names
        Names of the species, in the order of their indices.
    curves
        Names of curves, as `list_species_curves` returns them.

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
        A variable for each species, such as "species learner", without the dimension `agent`.
        Names of species alone could be those of coordinates.
    """
    species = data["species"]
    n_agents = species.notnull().sum("agent")
    shares = {}
    for index, name in enumerate(names):
        share = hold_last((species == index).sum("agent") / n_agents.where(n_agents > 0))
        meaning = f"share of agents of the species {name}"
        shares[f"species {name}"] = share.assign_attrs(long_name=meaning, valid_max=1.0)
    return xr.Dataset(shares)
