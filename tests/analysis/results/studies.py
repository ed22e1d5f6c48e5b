"""Hand-made studies and traces with known results."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from baldwinlab.analysis.results.contrasts import Contrasts, compare_final_values, final_values
from baldwinlab.experiment import Experiment, ExperimentError
from baldwinlab.experiment.conditions import Factors, factor_coordinates, read_factors
from baldwinlab.experiment.toml import to_toml
from baldwinlab.models.miniworld.appearance import appearance_json
from baldwinlab.papers.claims import Claim
from baldwinlab.papers.presets import load

RUNS = 8

AS_THE_PAPER: Mapping[str, Sequence[float]] = {
    "evo/A": range(80, 80 + RUNS),
    "evo+self-taught/A": range(120, 120 + RUNS),
    "self-taught/A": range(10, 10 + RUNS),
    "evo/B": [0] * RUNS,
    "evo+self-taught/B": range(50, 50 + RUNS),
    "self-taught/B": range(2, 2 + RUNS),
}


class Claims(NamedTuple):
    """The claims of a paper without measures."""

    claims: tuple[Claim, ...]

    def measures(self, name: str) -> dict[str, Any]:
        return {}


def study(
    eaten: Mapping[str, Sequence[float]], generations: int = 12, agents: int = 10, hungry: int = 6
) -> xr.Dataset:
    """Return a dataset in which every agent of a run eats the given number in every generation.

    NaN is a missing run. In `evo+self-taught/B`, `hungry` agents eat nothing in the first half of
    the generations.
    """
    runs = max(len(values) for values in eaten.values())
    food = np.full((len(eaten), runs, generations, agents), np.nan)
    for number, (name, values) in enumerate(eaten.items()):
        food[number, : len(values)] = np.reshape(list(values), (-1, 1, 1))
        if name == "evo+self-taught/B":
            food[number, : len(values), : generations // 2, :hungry] *= 0  # NaN remains NaN.
    dims = ("condition", "run", "generation", "agent")
    coords = {
        "condition": list(eaten),
        "run": range(runs),
        "generation": range(generations),
        "agent": range(agents),
    }
    texts = [to_toml(experiment(name, generations, agents)) for name in eaten]
    factors = [
        Factors(*name.rpartition("/")[::2]) if "/" in name else Factors(name) for name in eaten
    ]
    data = {
        "food_eaten": (dims, food),
        "energy": (dims, food.copy()),
        "experiment": ("condition", texts),
    }
    return xr.Dataset(data, coords | factor_coordinates(factors), {"seed": 7})


def experiment(name: str, generations: int, agents: int) -> Experiment:
    """Return the preset of that name, or a custom experiment."""
    try:
        base = load(name)
    except ExperimentError:
        base = Experiment(name=name)
    return base.replace(evolution={"generations": generations}, population={"size": agents})


def trace(
    condition: str, generation: int, run: int = 0, steps: int = 60, agents: int = 10
) -> xr.Dataset:
    """Return a trace. The agents walk to the right across the edge, and every second one eats."""
    x = (160.0 + np.arange(steps)[:, None] * 12.0 + np.arange(agents)) % 640
    eaten = np.zeros((steps, agents), np.int32)
    eaten[-1, ::2] = 1
    dims = ("step", "agent")
    provenance = {
        "experiment": to_toml(experiment(condition, 12, agents)),
        "appearance": appearance_json(experiment(condition, 12, agents)),
        "condition": condition,
        "run": run,
        "generation": generation,
    }
    return xr.Dataset(
        {"x": (dims, x), "y": (dims, np.full_like(x, 150.0)), "eaten": (dims, eaten)},
        attrs=provenance,
    )


def species_trace(sizes: Mapping[str, int], steps: int = 40) -> xr.Dataset:
    """Return a trace of species that walk to the right in rows. `sizes`: agents by species.

    In each species, the last agent eats in the first step and dies in the middle of the lifetime.
    """
    n_agents = sum(sizes.values())
    species = np.repeat(np.arange(len(sizes), dtype=np.int32), [*sizes.values()])
    single = trace("evo/A", 1, steps=steps, agents=n_agents)
    is_last = np.append(np.diff(species) > 0, True)
    is_dead = (np.arange(steps)[:, None] >= steps // 2) & is_last
    dims = ("step", "agent")
    x = 20.0 + np.arange(steps)[:, None] + 40 * np.arange(n_agents)
    eaten = np.zeros((steps, n_agents), np.int32)
    eaten[0, is_last] = 1
    items = np.full((steps, count_items(single)), 600.0)
    return single.assign(
        x=(dims, np.where(is_dead, np.nan, x)),
        y=(dims, np.where(is_dead, np.nan, 100.0 + 60 * species + np.zeros_like(x))),
        heading=(dims, np.zeros_like(x)),
        eaten=(dims, eaten),
        alive=(dims, (~is_dead).astype(np.int8)),
        item_x=(("step", "item"), items),
        item_y=(("step", "item"), items),
        species=("agent", species),
    ).assign_attrs(species_names=", ".join(sizes))


def count_items(single: xr.Dataset) -> int:
    kinds = json.loads(single.attrs["appearance"])["item_kinds"]
    return sum(kind["number"] for kind in kinds)


def compare_conditions(dataset: xr.Dataset, last: int = 10, baseline: str = "") -> Contrasts:
    """Compare the conditions of a dataset: `find_references` explains the baseline."""
    return compare_final_values(final_values(dataset, last), read_factors(dataset), last, baseline)
