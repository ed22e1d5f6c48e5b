"""Fitness sharing, which divides the fitness of an agent by the number of similar agents.

References
----------
.. [1] D. E. Goldberg and J. Richardson, "Genetic algorithms with sharing for multimodal function
   optimization", Proceedings of the 2nd International Conference on Genetic Algorithms (1987).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.simd import square_root
from baldwinlab.evolution.neat.operators import genome_part
from baldwinlab.evolution.proportional_selection import spin
from baldwinlab.evolution.rng_key import Genome
from baldwinlab.experiment import BaseExperiment
from baldwinlab.parts import Field, Generation, Selection


@compiled
def compute_distance(genome: Genome, first: int, second: int) -> float:
    """Return the root mean square difference between the genes of two agents."""
    n_modules = genome.shape[1]
    n_weights = genome.shape[2]
    total = 0.0
    for module in range(n_modules):
        for weight in range(n_weights):
            difference = np.float64(genome[first, module, weight]) - np.float64(
                genome[second, module, weight]
            )
            total += difference * difference
    return float(square_root(total / (n_modules * n_weights)))


@compiled
def _share(part: Any, distance: float) -> float:
    """Return the sharing function: 1 at distance 0, and 0 from the radius on."""
    if distance >= part.limit:
        return 0.0
    power = 1.0
    for _ in range(part.exponent):
        power *= distance / part.limit
    return 1.0 - power


class FitnessSharing(Selection, name="fitness-sharing"):
    """Roulette on shared fitness: the fitness of an agent, divided by its niche count.

    The niche count is the sum of 1 - (d / radius)^exponent over all agents at a distance d below
    `radius`, the agent included. The distance is the root mean square difference of the genes.
    Groups of similar agents then have children in proportion to the fitness of their members, and
    not to their number. Fitness must not be negative.

    References
    ----------
    Goldberg and Richardson 1987.
    """

    minimum_fitness: ClassVar[float] = 0.0

    radius: float = Field(
        0.5,
        gt=0,
        le=1_000_000,
        description="Distance from which agents share no fitness, in units of a gene.",
    )
    exponent: int = Field(
        1, ge=1, le=10, description="Exponent of the sharing function. 1: it falls linearly."
    )
    # A numeric field is float32 in a hook.
    derived: ClassVar[Mapping[str, Any]] = {"limit": lambda part, experiment: float(part.radius)}

    def check(self, experiment: BaseExperiment) -> None:
        if genome_part(experiment).has_graph_genomes:
            raise ValueError(
                "evolution.selection = 'fitness-sharing' compares genomes gene by gene, and the "
                "genomes are graphs: choose evolution.selection = 'species'"
            )

    @staticmethod
    def select(part: Any, generation: Generation) -> None:
        fitness = generation.fitness
        for agent in range(fitness.size):
            # The agent shares its fitness with itself.
            niche_count = 1.0
            for neighbor in range(fitness.size):
                if neighbor != agent:
                    distance = compute_distance(generation.lifetimes.genome, agent, neighbor)
                    niche_count += _share(part, distance)
            generation.shares[agent] = fitness[agent] / niche_count
        spin(generation.uniforms, generation.shares, generation.parents)
