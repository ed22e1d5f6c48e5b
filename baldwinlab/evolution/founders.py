"""Genomes without parents: every weight is drawn from N(0, 1).

The hook `init_founders` of a variation may change them.

References
----------
Le 2019, section "The neural network controller".
"""

from __future__ import annotations

from typing import Final

import numpy as np

from baldwinlab.engine import poison, rng
from baldwinlab.engine.arithmetic import normal_quantile
from baldwinlab.engine.jit import jit_entry_point
from baldwinlab.evolution.finite import require_finite
from baldwinlab.evolution.rng_key import GenerationKey, Genome
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.parts.breeding import breeding_part

WEIGHTS_OF_MODULE: Final = {
    "action": rng.ACTION_WEIGHTS,
    "reinforcement": rng.REINFORCEMENT_WEIGHTS,
}


def draw_genomes(experiment: BaseExperiment, key: GenerationKey) -> Genome:
    """Draw the genomes of a generation without parents; raise RefusedError if not finite."""
    if not isinstance(experiment, Experiment):
        founders = np.ascontiguousarray(
            experiment.of_model.founders(experiment.population.size, key), np.float32
        )
        require_finite(experiment, key, founders, "model")
        return founders
    genome = poison.empty(
        (experiment.population.size, len(experiment.modules), experiment.genome_length), np.float32
    )
    for module, purpose in enumerate(purposes(experiment)):
        draw_normal(key, purpose, genome, module)
    variation = breeding_part(experiment, "variation")[0]
    type(variation).part.init_founders(variation, genome)
    require_finite(experiment, key, genome, "evolution.variation")
    return genome


def purposes(experiment: Experiment) -> list[int]:
    """Return the purpose of the random numbers of each module, a constant of `engine.rng`."""
    return [
        WEIGHTS_OF_MODULE.get(name, rng.MODULE_WEIGHTS + number)
        for number, name in enumerate(experiment.modules)
    ]


@jit_entry_point
def draw_normal(key: GenerationKey, purpose: int, genome: Genome, module: int) -> None:
    """Fill one module of `genome` from N(0, 1). One draw of the generator gives four weights."""
    for agent in range(genome.shape[0]):
        for first in range(0, genome.shape[2], 4):
            words = rng.philox(first // 4, agent, key.generation, purpose, key.seed, key.run)
            for weight in range(first, min(first + 4, genome.shape[2])):
                genome[agent, module, weight] = np.float32(
                    normal_quantile(rng.uniform(words[weight - first]))
                )
