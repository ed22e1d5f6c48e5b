"""Small worlds that several tests share."""

from __future__ import annotations

import math
from typing import Any

import xarray as xr

from baldwinlab.experiment import Experiment
from baldwinlab.papers.presets import load
from baldwinlab.simulation.replay import replay


def point(x: float, y: float, count: int = 1, energy: float = 1.0) -> dict[str, Any]:
    """A food region so small that in float32 it is one point."""
    return {
        "x": [x, math.nextafter(x, math.inf)],
        "y": [y, math.nextafter(y, math.inf)],
        "count": count,
        "energy": energy,
    }


def exact(
    agent: tuple[float, float], items: list[tuple[float, float]], **changes: Any
) -> Experiment:
    """All agents at one point, and items at others, where each reappears."""
    x, y = agent
    world = {
        "width": 200,
        "height": 160,
        "start": {"x": x, "y": y, "radius": 0},
        "food": [point(*item) for item in items],
    }
    alone = load("evo/A").replace(
        world=world, population={"size": 1}, lifetime={"steps": 1}, evolution={"generations": 1}
    )
    return alone.replace(**changes)


def life_that_begins_with(action: int, experiment: Experiment) -> xr.Dataset:
    """The trace of an agent whose weights are such that it begins with `action`."""
    traces = (replay(experiment, seed=seed) for seed in range(200))
    return next(trace for trace in traces if trace["action"].values[0, 0] == action)


def small(condition: str, **changes: Any) -> Experiment:
    """A condition of the paper in a world where newborns find food at once; few agents, short lives."""
    food = [{"x": [20, 100], "y": [10, 90], "count": 12}]
    world = {"width": 120, "height": 100, "start": {"x": 60, "y": 50, "radius": 40}, "food": food}
    shrunk = load(f"{condition}/A").replace(
        world=world,
        population={"size": 6},
        lifetime={"steps": 80},
        evolution={"generations": 3},
        network={"hidden": [4]},
    )
    return shrunk.replace(**changes)
