"""Single mutants: copies of genomes with one mutation each, by the variation of an experiment.

The variation makes a child of each agent with itself, so recombination has no effect. A mutant has
one of the genes that differ in this child, chosen at random.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from baldwinlab.engine import rng
from baldwinlab.evolution.breeding import make_children
from baldwinlab.evolution.rng_key import GenerationKey, Genome
from baldwinlab.experiment import BaseExperiment


def make_single_mutants(experiment: BaseExperiment, key: GenerationKey, genome: Genome) -> Genome:
    """Return a single mutant of each agent.

    - `experiment`: the experiment with the variation. If the variation has a mutation rate, it is
      set to 1, so that each of its genes mutates with equal probability.
    - `key`: key of the random numbers. No generation of the run may have it.
    - `genome`: [agent, module, weight] with the same genes at the same entries.

    Returns the mutants. A mutant equals its agent if the variation changes none of its genes.
    """
    n_agents = len(genome)
    experiment = _mutate_all_genes(experiment)
    itself = np.repeat(np.arange(n_agents, dtype=np.int32)[:, None], 2, axis=1)
    equal_fitness = np.zeros(n_agents)
    children = make_children(experiment, key, genome, equal_fitness, itself).reshape(n_agents, -1)
    mutants = genome.reshape(n_agents, -1).copy()
    draws = key.uniforms(rng.SELECTION, (n_agents, 1))[:, 0, 0]
    for mutant, child, draw in zip(mutants, children, draws, strict=True):
        changed_genes = np.flatnonzero(child != mutant)
        if changed_genes.size:
            gene = changed_genes[int(draw * changed_genes.size)]
            mutant[gene] = child[gene]
    return mutants.reshape(genome.shape)


@lru_cache(maxsize=64)
def _mutate_all_genes(experiment: BaseExperiment) -> BaseExperiment:
    """Return the experiment with the mutation rate 1, if its variation has a rate."""
    if "mutation_rate" not in experiment.part("evolution.variation").reads:
        return experiment
    return experiment.replace(evolution={"mutation_rate": 1.0})
