"""Model of agents that are numbers on a fitness slope, with learning as one step uphill.

    baldwinlab reproduce paenke-2007

A genome has one gene x with the innate fitness f(x) = exp(slope * x + curvature * x^2 / 2). The
logarithm of fitness is convex for `curvature` > 0, linear for 0, and concave for `curvature` < 0.
An agent that learns has the fitness f(x + step).

The gain function is g(x) = f(x + step) / f(x). Learning accelerates evolution where g increases
with x, and slows evolution where g decreases. In this model, log g(x) = constant + step * curvature
* x.

Population size, standard deviation of x and mutation are not in the papers and are our choice.

References
----------
I. Paenke, B. Sendhoff and T. J. Kawecki, "Influence of plasticity and learning on evolution under
directional selection", The American Naturalist 170 (2007).
I. Paenke, T. J. Kawecki and B. Sendhoff, "The influence of learning on evolution: a mathematical
framework", Artificial Life 15 (2009).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from baldwinlab.models import kit
from baldwinlab.parts import Field, LifeResults, Measure, Model, Variable


class SlopeClimbers(Model, name="slope-climbers"):
    """Numbers on a fitness slope that learn one step uphill."""

    slope: float = Field(
        0.0, ge=-10, le=10, description="Slope of the logarithm of fitness at x = 0."
    )
    curvature: float = Field(
        1.0,
        ge=-10,
        le=10,
        description="Curvature of the logarithm of fitness. Above 0: convex; below 0: concave.",
    )
    learning: bool = Field(True, description="Whether agents learn a step.")
    learning_step: float = Field(0.3, ge=-10, le=10, description="Step that learning adds to x.")
    initial_mean: float = Field(0.75, ge=-10, le=10, description="Mean x of the founders.")
    initial_std: float = Field(
        0.1, ge=0, le=10, description="Standard deviation of x among the founders."
    )

    defaults = {
        "population": {"size": 1000},
        "evolution": {
            "generations": 21,
            "variation": "gaussian",
            "mutation_rate": 1.0,
            "mutation_size": 0.03,
        },
    }
    records = {
        "innate_x": Variable.quantity("x", "x at birth"),
        "uphill": Variable.flag("1 if fitness rises with x at birth, else 0"),
    }
    innate_trait = "innate_x"
    learning_amount = "learning_step"
    settings_without_learning = {"learning": False}
    assimilation_obstacle = "Learning adds the same step to x in every life."
    measures = {
        "climb": Measure(
            "increase of mean innate x, first to last generation",
            kit.change_of_mean("innate_x", 0, -1),
        ),
        "uphill": Measure(
            "share of agents born where fitness rises with x, minimum over generations",
            lambda runs: runs["uphill"].mean("agent").min("generation"),
        ),
    }

    def check(self, experiment: Any) -> None:
        if self.slope == self.curvature == 0:
            raise ValueError(
                "slope_climbers.slope and slope_climbers.curvature are both 0: there is no slope"
            )

    def n_weights(self) -> int:
        return 1

    def founders(self, agents: int, key: Any) -> kit.Genomes:
        mean = np.float32(self.initial_mean)
        std = np.float32(self.initial_std)
        return mean + std * kit.draw_normal_numbers(key, agents, self.n_weights())

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: kit.Genomes
    ) -> LifeResults:
        innate_x = genomes[:, :, 0, 0]
        step = self.learning_step if self.learning else 0
        learned_x = innate_x + np.float32(step)
        fitness = self.fitness(learned_x.astype(np.float64))
        log_fitness_slope = self.slope + self.curvature * innate_x
        records = {"innate_x": innate_x, "uphill": log_fitness_slope > 0}
        return self.make_results(fitness, records, learned=learned_x[:, :, None])

    def fitness(self, x: kit.Numbers) -> kit.Numbers:
        """Return the fitness f(x) for an array `x` of any shape."""
        return kit.exponentiate(self.slope * x + self.curvature * x * x / 2)
