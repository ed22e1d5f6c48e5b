"""Small worlds for tests."""

from __future__ import annotations

import math
from typing import Any

import xarray as xr

from baldwinlab.experiment import Experiment
from baldwinlab.papers.presets import load
from baldwinlab.simulation.replay import replay


def make_point_region(x: float, y: float, count: int = 1, energy: float = 1.0) -> dict[str, Any]:
    """Return a food region that is a single point in float32."""
    return {
        "x": [x, math.nextafter(x, math.inf)],
        "y": [y, math.nextafter(y, math.inf)],
        "count": count,
        "energy": energy,
    }


def make_single_agent_experiment(
    agent: tuple[float, float], items: list[tuple[float, float]], **changes: Any
) -> Experiment:
    """Return an experiment with a single agent and with items that reappear in place."""
    x, y = agent
    world = {
        "width": 200,
        "height": 160,
        "start": {"x": x, "y": y, "radius": 0},
        "food": [make_point_region(*item) for item in items],
    }
    experiment = load("evo/A").replace(
        world=world, population={"size": 1}, lifetime={"steps": 1}, evolution={"generations": 1}
    )
    return experiment.replace(**changes)


def replay_with_first_action(action: int, experiment: Experiment) -> xr.Dataset:
    """Return the trace of the first seed whose agent 0 begins with `action`."""
    traces = (replay(experiment, seed=seed) for seed in range(200))
    return next(trace for trace in traces if trace["action"].values[0, 0] == action)


def make_small_experiment(condition: str, **changes: Any) -> Experiment:
    """Return a condition with few agents and short lifetimes in a small world with food."""
    food = [{"x": [20, 100], "y": [10, 90], "count": 12}]
    world = {"width": 120, "height": 100, "start": {"x": 60, "y": 50, "radius": 40}, "food": food}
    experiment = load(f"{condition}/A").replace(
        world=world,
        population={"size": 6},
        lifetime={"steps": 80},
        evolution={"generations": 3},
        network={"hidden": [4]},
    )
    return experiment.replace(**changes)


PREY_ENERGY = 5.0
N_PREDATORS = 5
N_PREY = 15


def make_predation(**changes: Any) -> Experiment:
    """Return an experiment in which predators eat prey, and prey eats food."""
    species = [
        {
            "name": "predators",
            "size": N_PREDATORS,
            "eats": {"items": [], "prey": [{"species": "prey", "energy": PREY_ENERGY}]},
            "senses": {"kinds": ["food", "species-nearness"], "visual_radius": 30},
        },
        {
            "name": "prey",
            "size": N_PREY,
            "senses": {
                "kinds": ["food", "species-in-sight", "compass"],
                "species_in_sight": {"target": "predators"},
            },
            "learning": {"rule": "self-taught"},
        },
    ]
    settings: dict[str, Any] = {
        "population": {"size": N_PREDATORS + N_PREY, "species": species},
        "lifetime": {"steps": 60},
    }
    return make_small_experiment("evo", **settings | changes)
