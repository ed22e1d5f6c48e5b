"""The experiments of the explorable, its seed, and the numbers that a reader can change.

The experiments are conditions of `le-2019` on map A, with lifetimes of a fifth of the length, so
that a browser simulates a run in about a second.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Final, NamedTuple

from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.models.miniworld.backends.wasm_modules import MAP_FEATURES
from baldwinlab.papers import presets

SEED: Final = 7
RUNS: Final = 5
STEPS: Final = 1000
# Generations of a run. Learning is switched off at a fork.
GENERATIONS: Final = 100
FORK_GENERATION: Final = 60
# The generations of the comparison at the end of a run.
LAST_GENERATIONS: Final = 10
# The lifetime on the first map: agents eat early and often.
FIRST_RUN: Final = 3
FIRST_GENERATION: Final = 20
# The needle: the recorded costs of a trial, and the recorded periods. 0: the needle never moves.
NEEDLE_COSTS: Final = (0.25, 0.5, 1.0, 1.5, 2.0)
NEEDLE_PERIODS: Final = (2, 5, 10, 20, 50, 100)
NEEDLE_RUNS: Final = 3


class Dial(NamedTuple):
    """A number in a sentence that the reader can change."""

    # The value at opening, and the possible values.
    value: float
    minimum: float
    maximum: float
    step: float
    path: str = ""  # The setting, or "" if the figure uses the number in another way.


DIALS: Final[Mapping[str, Dial]] = {
    "visual_radius": Dial(40, 10, 80, 5, "senses.visual_radius"),
    "food": Dial(50, 5, 150, 5, "world.food.0.count"),
    "mutation_rate": Dial(5, 0, 30, 1, "evolution.mutation_rate"),
    "agents": Dial(20, 4, 40, 2, "population.size"),
    "rate": Dial(0.01, 0, 0.1, 0.005, "learning.rate"),
    "runs": Dial(RUNS, 1, RUNS, 1),
    "fork": Dial(FORK_GENERATION, 10, 80, 10),
    # The indices of the recorded costs and periods.
    "cost": Dial(2, 0, len(NEEDLE_COSTS) - 1, 1),
    "period": Dial(2, 0, len(NEEDLE_PERIODS) - 1, 1),
}


@cache
def make_scenes() -> Mapping[str, Experiment]:
    """Return the experiments of the page by name.

    `map` is the experiment of the reader's own map. `yoked` is the only one that a browser cannot
    simulate.
    """
    conditions = {
        "alone": "evo/A",
        "learning": "evo+self-taught/A",
        "random": "evo+random-targets/A",
    }
    scenes = {name: _shorten(presets.load(condition)) for name, condition in conditions.items()}
    learning = scenes["learning"]
    return {
        **scenes,
        "yoked": learning.replace(name="yoked", learning={"control": "yoked"}),
        "map": learning.replace(name="map", world={"features": MAP_FEATURES}),
    }


def make_forked_scene() -> Experiment:
    """Return the learners whose learning is switched off at the fork."""
    return make_scenes()["learning"].replace(
        schedule=[{"generation": FORK_GENERATION, "learning.rate": 0.0}]
    )


def make_needle(cost: float, period: int) -> BaseExperiment:
    """Return the moving needle with a cost of trials and a period."""
    return presets.load("guessing/every-10").replace(
        moving_needle={"cost_of_trials": cost, "period": period}
    )


def _shorten(experiment: BaseExperiment) -> Experiment:
    shortened = experiment.replace(
        lifetime={"steps": STEPS}, evolution={"generations": GENERATIONS}
    )
    assert isinstance(shortened, Experiment)
    return shortened
