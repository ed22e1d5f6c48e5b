"""Model of linear reaction norms in an environment that changes suddenly.

    baldwinlab reproduce lande-2009

A genome has the intercept a and the slope b of a reaction norm. An individual develops the
phenotype z = a + b e from the cue e. Later, the environment of selection s sets the optimum B s.
The fitness is exp(-(z - B s)^2 / (2 width^2) - cost b^2 / 2).

The mean environment is 0 before the generation `jump_generation`, and `jump` from then on. In each
generation, s and e are the mean environment plus normal random deviations. The two deviations have
the correlation `predictability`. The founders are adapted to the mean environment 0.

In the paper, developmental noise is added to z. This model has no such noise. Instead, the square
of `peak_width` includes the variance of the noise. All constants are our choice.

References
----------
R. Lande, "Adaptation to an extraordinary environment by evolution of phenotypic plasticity and
genetic assimilation", Journal of Evolutionary Biology 22 (2009).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np

from baldwinlab.core.deferred import xr
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
