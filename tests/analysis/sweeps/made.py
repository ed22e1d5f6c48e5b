"""Artificial sweeps, in the form of `Study.data`."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

DIMS = ("run", "generation", "agent")
# [learning.rate 0.1 and 0.01, items 0, 10 and 50]
GRID_ENERGY = np.array([[0, 1.5, 10], [0, 4.5, 14]])
MEANINGS = {
    "learning.rate": "learning rate, per step",
    "world.food.0.count": "number of items in the region at any time",
    "evolution.selection": (
        "roulette wheel; tournament of 2; uniform from the upper half; linear rank (R4)"
    ),
}


def grid(runs: int = 3, flat: bool = False) -> xr.Dataset:
    """Return a grid with the energy `GRID_ENERGY`, which differs a little between runs."""
    energy = np.array([GRID_ENERGY[0], GRID_ENERGY[0]]) if flat else GRID_ENERGY
    by_run = energy[..., None] + (np.arange(runs) - (runs - 1) / 2) * (energy > 0)[..., None]
    fields = {"learning.rate": [0.1, 0.01], "world.food.0.count": [0, 10, 50]}
    eaten = ((*fields, *DIMS), by_run[..., None, None] * np.ones((12, 4)))
    return _sweep(eaten, {name: (name, values) for name, values in fields.items()}, "grid")


def sample(points: int) -> xr.Dataset:
    """Return a sample in which agents eat all items of their world."""
    generator = np.random.default_rng(3)
    rate = 10 ** generator.uniform(-4, 0, points)
    count = generator.permutation(np.arange(1, points + 1))
    selection = np.array(["rank", "roulette"])[np.arange(points) % 2]
    energy = count[:, None, None, None] * np.ones((points, 2, 3, 4))
    fields = {"learning.rate": rate, "world.food.0.count": count, "evolution.selection": selection}
    return _sweep(
        (("point", *DIMS), energy),
        {name: ("point", values) for name, values in fields.items()},
        "sobol",
    )


def _sweep(eaten: Any, fields: dict[str, Any], design: str) -> xr.Dataset:
    coords = {name: (*given, {"long_name": MEANINGS[name]}) for name, given in fields.items()}
    provenance = {
        "design": design,
        "fields": list(fields),
        "base": "evo/A",
        "set": ["lifetime.steps=1000"],
        "seed": 7,
    }
    dims, values = eaten
    return xr.Dataset(
        {name: (dims, values.copy()) for name in ("energy", "food_eaten")}, coords, provenance
    )
