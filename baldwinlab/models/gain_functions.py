"""Models of learning that speeds or slows evolution by the law of the gain function.

    baldwinlab reproduce paenke-2007
    baldwinlab reproduce mery-kawecki-2004

A genome has one gene x with the innate fitness f(x). An agent that learns has the fitness
f(x + d(x)). The gain function is g(x) = f(x + d) / f(x). Learning speeds evolution where g rises
with x, and slows evolution where g falls.

In the model `slope-climbers`, f(x) = exp(slope * x + curvature * x^2 / 2). The logarithm of fitness
is convex for `curvature` > 0, linear for 0, and concave for `curvature` < 0. Learning is a constant
step uphill, so log g(x) = constant + step * curvature * x. Population size, standard deviation of x
and mutation are not in the papers and are our choice.

In the model `egg-layers`, flies choose one of two media for their eggs, and learn from a bitter
taste. The gene x is the innate preference for the right medium on the logit scale. A fly lays the
fraction p(x) = 1 / (1 + exp(-x)) of its eggs on the right medium. Only these eggs count. Before a
fly lays eggs, the wrong medium contains bitter quinine. Learning from the taste raises the
preference from x to x + d(x). The slope of log g over x is (1 - p(x + d)) (1 + d'(x)) - (1 - p(x)).
The paper gives no learning function. By default (`both-media`), a fly must visit both media to
learn that they differ. Therefore, d is proportional to 2 p (1 - p), the probability that two visits
are to different media. Population size, variance, initial preference and `learning_shift` are ours.

References
----------
I. Paenke, B. Sendhoff and T. J. Kawecki, "Influence of plasticity and learning on evolution under
directional selection", The American Naturalist 170 (2007).
F. Mery and T. J. Kawecki, "The effect of learning on experimental evolution of resource preference
in Drosophila melanogaster", Evolution 58 (2004).
I. Paenke, T. J. Kawecki and B. Sendhoff, "The influence of learning on evolution: a mathematical
framework", Artificial Life 15 (2009).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

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
        return kit.draw_traits(key, agents, self.initial_mean, self.initial_std)

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


def choose_medium(preference: kit.Numbers) -> kit.Numbers:
    """Return the fraction p(x) = 1 / (1 + exp(-x)) of eggs on the right medium, for any shape.

    >>> choose_medium(np.array([-2.0, 0.0, 2.0])).round(2).tolist()
    [0.12, 0.5, 0.88]
    """
    share: kit.Numbers = 1 / (1 + kit.exponentiate(-preference))
    return share


class EggLayers(Model, name="egg-layers"):
    """Flies that choose a medium for their eggs and learn to avoid the wrong one."""

    right_medium: Literal["orange", "pineapple"] = Field(
        "pineapple", description="Medium on which eggs count."
    )
    orange_preference: float = Field(
        2.0,
        ge=-20,
        le=20,
        description="Mean innate preference of the founders for orange, in logits.",
    )
    initial_std: float = Field(
        0.2, ge=0, le=10, description="Standard deviation of the preference among the founders."
    )
    learning: bool = Field(True, description="Whether flies learn.")
    learning_shift: float = Field(
        1.5, ge=0, le=20, description="Largest change of the preference by learning, in logits."
    )
    experience: Literal["both-media", "wrong-medium", "constant"] = Field(
        "both-media",
        description=(
            "Visits on which learning depends. both-media: d = shift 4 p (1 - p); wrong-medium: "
            "d = shift (1 - p); constant: d = shift."
        ),
    )

    defaults = {
        "population": {"size": 1000},
        "evolution": {"generations": 24, "variation": "infinitesimal", "mutation_size": 0.14},
    }
    records = {
        "preference": Variable.quantity("logit", "innate preference for the right medium"),
        "innate_share": Variable.share(
            "share of eggs on the right medium by the innate preference"
        ),
        "learned_shift": Variable.quantity("logit", "change of the preference by learning"),
        "gain_slope": Variable.quantity(
            "1/logit", "slope of the logarithm of the gain of learning at the innate preference"
        ),
    }
    innate_trait = "preference"
    learned_distance = "learned_shift"
    learning_amount = "learning_shift"
    settings_without_learning = {"learning": False}
    payoff = "share of eggs on the right medium"
    measures = {
        "response": Measure(
            "increase of the mean innate preference, first to last generation",
            kit.change_of_mean("preference", 0, -1),
        ),
        "gain-slope": Measure(
            "slope of the logarithm of the gain of learning, mean over agents and generations",
            lambda runs: runs["gain_slope"].astype(np.float64).mean(("agent", "generation")),
        ),
    }

    @property
    def initial_preference(self) -> float:
        """Return the mean innate preference of the founders for the right medium."""
        is_orange = self.right_medium == "orange"
        return self.orange_preference if is_orange else -self.orange_preference

    def n_weights(self) -> int:
        return 1

    def founders(self, agents: int, key: Any) -> kit.Genomes:
        return kit.draw_traits(key, agents, self.initial_preference, self.initial_std)

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: kit.Genomes
    ) -> LifeResults:
        preference = genomes[:, :, 0, 0].astype(np.float64)
        innate_share = choose_medium(preference)
        shift, shift_slope = self.learn(innate_share)
        learned_preference = preference + shift
        fitness = choose_medium(learned_preference)
        gain_slope = (1 - fitness) * (1 + shift_slope) - (1 - innate_share)
        records = {
            "preference": preference,
            "innate_share": innate_share,
            "learned_shift": shift,
            "gain_slope": gain_slope,
        }
        return self.make_results(fitness, records, learned=learned_preference[:, :, None])

    def learn(self, innate_share: kit.Numbers) -> tuple[kit.Numbers, kit.Numbers]:
        """Return the learned shift d and its derivative d' over x, for `innate_share` p(x)."""
        wrong_share = 1 - innate_share
        # The derivative of p over x is p (1 - p).
        share_slope = innate_share * wrong_share
        if self.experience == "both-media":
            shift = 4 * share_slope
            slope = 4 * share_slope * (wrong_share - innate_share)
        elif self.experience == "wrong-medium":
            shift, slope = wrong_share, -share_slope
        else:
            shift, slope = np.ones_like(wrong_share), np.zeros_like(wrong_share)
        size = self.learning_shift if self.learning else 0.0
        return size * shift, size * slope
