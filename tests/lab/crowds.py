"""Worlds with so many agents that the lab shows their density."""

from __future__ import annotations

from typing import Any

from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import Experiment
from baldwinlab.lab.sources.life_query import Life, StartData
from baldwinlab.papers.presets import load
from tests.evolution.single_runs import draw_genomes

CROWD_SIZE = 5000
CROWD_ITEMS = 6000


def make_crowd(name: str = "evo/A", **changes: Any) -> Experiment:
    """Return an experiment with many agents and items on the standard map."""
    experiment = load(name)
    food = [region.model_copy(update={"count": CROWD_ITEMS}) for region in experiment.world.food]
    start = {"x": 400, "y": 160, "radius": 150, "headings": "random"}
    return experiment.replace(
        population={"size": CROWD_SIZE},
        lifetime={"steps": 60},
        evolution={"generations": 1},
        world={"food": food, "start": start},
    ).replace(**changes)


def make_life(experiment: Experiment, seed: int = 5) -> Life:
    """Return the first lifetime of run 0."""
    key = GenerationKey(seed, 0, 0)
    return Life(experiment, key, lambda: StartData(draw_genomes(experiment, key), None))
