"""Model of a trait that follows a moving optimum. Learning removes a fraction of the distance.

A genome has one gene, the trait x. The optimum starts at `jump` and moves by `speed` in each
generation. An agent at the distance d from the optimum learns the distance a d, where a is the
setting `learned_share`. The distance (1 - a) d remains. With the setting c (`cost`), the fitness is
exp(-((1 - a)^2 + c a^2) d^2 / (2 width^2)). Therefore, learning the distance a d costs as much as a
remaining distance of sqrt(c) a d.

The variation operator determines the genetic variance. With `infinitesimal`, the variance within
families is constant. With `gaussian`, the variance is a balance of mutation and selection, with a
small mutation in each birth (`mutation_rate` 1) or with rare large mutations.

References
----------
M. Lynch and R. Lande, "Evolution and extinction in response to environmental change", in: Biotic
interactions and global change (1993).
R. Lande, "Adaptation to an extraordinary environment by evolution of phenotypic plasticity and
genetic assimilation", Journal of Evolutionary Biology 22 (2009).
R. W. Anderson, "Learning and evolution: a quantitative genetics approach", Journal of Theoretical
Biology 175 (1995).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from baldwinlab.core.deferred import xr
from baldwinlab.experiment.measures import first_generation
from baldwinlab.models import kit
from baldwinlab.parts import Field, LifeResults, Measure, Model, Variable


def _variance_of_second_half(runs: xr.Dataset) -> xr.DataArray:
    """Return the variance of x at birth between agents, mean over the second half of the run."""
    innate = kit.select_second_half(runs["innate_x"].astype(np.float64))
    return innate.var("agent").mean("generation")


def _half_time(runs: xr.Dataset) -> xr.DataArray:
    """Return the first generation with at most half of the initial mean mismatch, or NaN."""
    mismatch = runs["mismatch_at_birth"].astype(np.float64).mean("agent")
    return first_generation(mismatch <= mismatch.isel(generation=0) / 2)


class MovingOptimum(Model, name="moving-optimum"):
    """Numbers that follow a moving optimum and learn a share of the distance to it."""

    speed: float = Field(
        0.02, ge=0, le=10, description="Distance that the optimum moves in each generation."
    )
    jump: float = Field(
        0.0,
        ge=0,
        le=1000,
        description="Distance of the optimum from the mean of the founders in generation 0.",
    )
    width: float = Field(
        2.0, ge=0.01, le=1000, description="Width of the peak of fitness, in units of x."
    )
    learning: bool = Field(True, description="Whether agents learn.")
    learned_share: kit.Share = Field(
        0.5, description="Share of the distance to the optimum that learning removes."
    )
    cost: float = Field(
        0.0,
        ge=0,
        le=1000,
        description="Cost of the squared learned distance, relative to that of a remaining one.",
    )
    initial_std: float = Field(
        0.4, ge=0, le=10, description="Standard deviation of x among the founders."
    )

    defaults = {
        "population": {"size": 1000},
        "evolution": {
            "generations": 401,
            "variation": "gaussian",
            "mutation_rate": 1.0,
            "mutation_size": 0.1,
        },
    }
    records = {
        "innate_x": Variable.quantity("x", "x at birth"),
        "mismatch_at_birth": Variable.quantity(
            "x", "optimum minus x at birth; above 0: behind the optimum"
        ),
        "mismatch_at_death": Variable.quantity("x", "optimum minus x at death, after learning"),
        "learned_distance": Variable.quantity("x", "distance between x at birth and at death"),
    }
    innate_trait = "innate_x"
    learned_distance = "learned_distance"
    learning_amount = "learned_share"
    settings_without_learning = {"learning": False}
    measures = {
        "mismatch": Measure(
            "optimum minus x at death, in the second half of the run",
            kit.mean_of_second_half("mismatch_at_death", np.float64),
        ),
        "mismatch-at-birth": Measure(
            "optimum minus x at birth, in the second half of the run",
            kit.mean_of_second_half("mismatch_at_birth", np.float64),
        ),
        "variance": Measure(
            "variance of x at birth, in the second half of the run", _variance_of_second_half
        ),
        "half-time": Measure(
            "first generation with half of the initial mismatch at birth", _half_time
        ),
    }

    @property
    def learns(self) -> bool:
        return self.learning and self.learned_share > 0

    def n_weights(self) -> int:
        return 1

    def founders(self, agents: int, key: Any) -> kit.Genomes:
        return np.float32(self.initial_std) * kit.draw_normal_numbers(key, agents, self.n_weights())

    def optimum(self, generation: int) -> float:
        """Return the optimum of a generation, in units of x. The mean x of the founders is 0."""
        return self.jump + self.speed * generation

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: kit.Genomes
    ) -> LifeResults:
        innate_x = genomes[:, :, 0, 0]
        share = self.learned_share if self.learning else 0.0
        mismatch = self.optimum(generation) - innate_x.astype(np.float64)
        learned = share * mismatch
        remaining = mismatch - learned
        energy = self.fitness(remaining * remaining)
        fitness = self.fitness(remaining * remaining + self.cost * learned * learned)
        records = {
            "innate_x": innate_x,
            "mismatch_at_birth": mismatch,
            "mismatch_at_death": remaining,
            "learned_distance": abs(learned),
        }
        learned_x = (innate_x + learned)[:, :, None]
        return self.make_results(energy, records, cost=energy - fitness, learned=learned_x)

    def fitness(self, squares: kit.Numbers) -> kit.Numbers:
        """Return the fitness at squared distances from the optimum, for an array of any shape."""
        return kit.exponentiate(-squares / (2 * self.width * self.width))
