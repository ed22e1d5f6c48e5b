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
    """Compute curves of each species, by name of the curve and of the species.

    `curves` are names that `list_species_curves` returns. "composition" is the share of the species
    in all agents. The fitness of a species without agents is NaN.
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
    n_agents = data["species"].notnull().sum("agent")
    energy = data["energy"].where(is_member)
    if curve == "mean":
        return energy.mean("agent")
    if curve == "share":
        is_above = (energy > 0).where(energy.notnull())
        return is_above.mean("agent").assign_attrs(valid_max=1.0)
    if curve == "composition":
        return (is_member.sum("agent") / n_agents.where(n_agents > 0)).assign_attrs(valid_max=1.0)
    counted = is_member if curve == "size" else data["alive"].where(is_member)
    counts = counted.sum("agent").where(n_agents > 0)
    return counts.assign_attrs(valid_max=float(n_agents.max()))
