"""Models of traits that evolve and change by plasticity, as in quantitative genetics.

    baldwinlab reproduce lande-2009

In the model `linear-norms`, a genome has the intercept a and the slope b of a reaction norm. An
individual develops the phenotype z = a + b e from the cue e. Later, the environment of selection s
sets the optimum B s. The fitness is exp(-(z - B s)^2 / (2 width^2) - cost b^2 / 2).

The mean environment is 0 before the generation `jump_generation`, and `jump` from then on. In each
generation, s and e are the mean environment plus normal random deviations. The two deviations have
the correlation `predictability`. The founders are adapted to the mean environment 0.

In the paper, developmental noise is added to z. This model has no such noise. Instead, the square
of `peak_width` includes the variance of the noise. All constants are our choice.

In the model `moving-optimum`, a genome has one gene, the trait x. The optimum starts at `jump` and
moves by `speed` in each generation. An agent at the distance d from the optimum learns the distance
a d, where a is the setting `learned_share`. The distance (1 - a) d remains. With the setting c
(`cost`), the fitness is exp(-((1 - a)^2 + c a^2) d^2 / (2 width^2)). Therefore, learning the
distance a d costs as much as a remaining distance of sqrt(c) a d.

The variation operator determines the genetic variance. With `infinitesimal`, the variance within
families is constant. With `gaussian`, the variance is a balance of mutation and selection, with a
small mutation in each birth (`mutation_rate` 1) or with rare large mutations.

References
----------
R. Lande, "Adaptation to an extraordinary environment by evolution of phenotypic plasticity and
genetic assimilation", Journal of Evolutionary Biology 22 (2009).
M. Lynch and R. Lande, "Evolution and extinction in response to environmental change", in: Biotic
interactions and global change (1993).
R. W. Anderson, "Learning and evolution: a quantitative genetics approach", Journal of Theoretical
Biology 175 (1995).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np

from baldwinlab.core.deferred import xr
from baldwinlab.experiment.measures import first_generation
from baldwinlab.models import kit
from baldwinlab.parts import (
    LIFE,
    Field,
    LifeResults,
    Measure,
    Model,
    Variable,
    normal_quantile,
    uniforms,
)

# Generation that separates the phases of the measures: expected rise and later fall of the slope.
PHASE_END: Final = 20


class Environment(NamedTuple):
    """Environment of a generation, the same for all agents of a run."""

    cue: float  # Environment during development, e.
    selection: float  # Environment during selection, s.


def _rate_ratio(runs: xr.Dataset) -> xr.DataArray:
    """Return the mean slope's rise per generation to `PHASE_END`, divided by the later fall."""
    # At least 1, because a run can end before `PHASE_END`.
    later_generations = max(1, runs.sizes["generation"] - 1 - PHASE_END)
    rise = kit.change_of_mean("slope", 0, PHASE_END)(runs) / PHASE_END
    fall = -kit.change_of_mean("slope", PHASE_END, -1)(runs) / later_generations
    return rise / fall


def _early_fitness(runs: xr.Dataset) -> xr.DataArray:
    """Return the mean fitness over the generations 1 to `PHASE_END`."""
    fitness = runs["energy"].isel(generation=slice(1, PHASE_END + 1))
    return fitness.mean(("agent", "generation"))


class LinearNorms(Model, name="linear-norms"):
    """Linear reaction norms in an environment that changes suddenly."""

    plasticity: float = Field(
        1.0, ge=0, le=100, description="Factor of the slope in development. 0: no plasticity."
    )
    plasticity_cost: float = Field(
        0.0, ge=0, le=10, description="Cost c of plasticity: fitness falls by exp(-c slope^2 / 2)."
    )
    predictability: float = Field(
        0.25,
        ge=-1,
        le=1,
        description="Correlation of the noise of the cue and of the environment of selection.",
    )
    jump: float = Field(
        3.0, ge=-100, le=100, description="Change of the mean environment, in units of the cue."
    )
    jump_generation: int = Field(
        1, ge=0, le=1_000_000, description="First generation in the new mean environment."
    )
    noise_std: float = Field(
        1.0, ge=0, le=100, description="Standard deviation of the environment around its mean."
    )
    optimum_slope: float = Field(
        2.0, ge=-100, le=100, description="Slope B of the optimum over the environment."
    )
    peak_width: float = Field(
        3.2, gt=0, le=1000, description="Width of the fitness peak, developmental noise included."
    )
    intercept_std: float = Field(
        0.7, gt=0, le=100, description="Genetic standard deviation of the intercept."
    )
    slope_std: float = Field(
        0.45, gt=0, le=100, description="Genetic standard deviation of the slope."
    )

    # The genes are in units of `intercept_std` and `slope_std`. Without selection, the variance of
    # each gene stays 1: twice the variance of segregation, which is 0.7071^2.
    defaults = {
        "population": {"size": 200},
        "evolution": {"generations": 601, "variation": "infinitesimal", "mutation_size": 0.7071},
        "record": {"genome_every": 20},
    }
    records = {
        "intercept": Variable.quantity("z", "intercept of the reaction norm"),
        "slope": Variable.quantity("z/e", "slope of the reaction norm"),
        "plastic_response": Variable.quantity("z", "absolute change of the phenotype by the cue"),
        "mismatch": Variable.quantity("z", "phenotype minus the optimum in this generation"),
    }
    innate_trait = "intercept"
    learned_distance = "plastic_response"
    learning_amount = "plasticity"
    settings_without_learning = {"plasticity": 0.0}
    measures = {
        "slope-rise": Measure(
            "change of the mean slope from generation 0 to 20",
            kit.change_of_mean("slope", 0, PHASE_END),
        ),
        "slope-fall": Measure(
            "decrease of the mean slope from generation 20 to the last",
            lambda runs: -kit.change_of_mean("slope", PHASE_END, -1)(runs),
        ),
        "intercept-rise": Measure(
            "change of the mean intercept from generation 20 to the last",
            kit.change_of_mean("intercept", PHASE_END, -1),
        ),
        "rate-ratio": Measure(
            "increase of the mean slope per generation to generation 20, divided by its decrease "
            "per generation later",
            _rate_ratio,
        ),
        "slope-at-20": Measure(
            "mean slope in generation 20", kit.mean_at("slope", PHASE_END, np.float64)
        ),
        "intercept-at-20": Measure(
            "mean intercept in generation 20", kit.mean_at("intercept", PHASE_END, np.float64)
        ),
        "final-slope": Measure(
            "mean slope in the last generation", kit.mean_at("slope", -1, np.float64)
        ),
        "final-intercept": Measure(
            "mean intercept in the last generation", kit.mean_at("intercept", -1, np.float64)
        ),
        "early-fitness": Measure("fitness, mean over generations 1 to 20", _early_fitness),
    }

    def n_weights(self) -> int:
        return 2

    def founders(self, agents: int, key: Any) -> kit.Genomes:
        genomes = kit.draw_normal_numbers(key, agents, self.n_weights())
        # With the mean environment 0, selection leads to the slope predictability * B.
        genomes[..., 1] += np.float32(self.predictability * self.optimum_slope / self.slope_std)
        return genomes

    def environment(self, seed: int, run: int, generation: int) -> Environment:
        """Draw the environment of a generation: the cue e and the environment of selection s."""
        mean = self.jump if generation >= self.jump_generation else 0.0
        draws = uniforms(seed, run, generation, LIFE, (1, 1))[0, 0]
        deviation, independent = (normal_quantile(float(draw)) for draw in draws[:2])
        independent_share = (1 - self.predictability**2) ** 0.5
        cue_deviation = self.predictability * deviation + independent_share * independent
        return Environment(mean + self.noise_std * cue_deviation, mean + self.noise_std * deviation)

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: kit.Genomes
    ) -> LifeResults:
        environments = [self.environment(seed, run, generation) for run in runs]
        # Both are [run, 1], because all agents of a run have the same environment.
        cue, selection = np.array(environments).T[:, :, None]
        weights = genomes[:, :, 0].astype(np.float64)
        intercept = self.intercept_std * weights[..., 0]
        slope = self.slope_std * weights[..., 1]
        expressed_slope = self.plasticity * slope
        response = expressed_slope * cue
        mismatch = intercept + response - self.optimum_slope * selection
        log_fitness = -((mismatch / self.peak_width) ** 2) / 2
        log_fitness -= self.plasticity_cost * expressed_slope**2 / 2
        fitness = kit.exponentiate(log_fitness)
        records = {
            "intercept": intercept,
            "slope": slope,
            "plastic_response": np.abs(response),
            "mismatch": mismatch,
        }
        return self.make_results(fitness, records)


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
        return kit.draw_traits(key, agents, 0.0, self.initial_std)

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
