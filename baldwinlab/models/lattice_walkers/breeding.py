"""Selection by fixation of one mutant, and mutation to a neighboring position.

References
----------
P. A. P. Moran, "Random processes in genetics", Mathematical Proceedings of the Cambridge
Philosophical Society 54 (1958).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.parts import Field, Generation, Mating, Selection, Variation
from baldwinlab.parts.breeding import ITSELF


@compiled
def fixation_probability(mutant: float, resident: float, size: int) -> float:
    """Return the probability that a mutant replaces a population of `size` members.

    The process is that of Moran. With x = resident / mutant, the probability is
    1 / (1 + x + x^2 + ... + x^(size - 1)).
    """
    if mutant == 0.0:
        return 0.0
    ratio = resident / mutant
    total = 1.0
    for _ in range(size - 1):
        total = 1.0 + ratio * total
    return 1.0 / total


class MutantFixation(Selection, name="mutant-fixation"):
    """A mutant replaces a population with its probability of fixation.

    The agents 2 i and 2 i + 1 are a population and its mutant. Agent 2 i of the next generation is
    a copy of the winner, and agent 2 i + 1 is a new mutant of it. An agent without a mutant
    survives.

    References
    ----------
    Moran 1958.
    """

    members: int = Field(10, ge=1, le=1000, description="Number of members of a population.")

    minimum_fitness = 0.0
    has_groups = True

    @staticmethod
    def select(part: Any, generation: Generation) -> None:
        parents = generation.parents
        n_pairs = parents.shape[0] // 2
        for pair in range(n_pairs):
            resident = 2 * pair
            mutant = resident + 1
            probability = fixation_probability(
                generation.fitness[mutant], generation.fitness[resident], part.members
            )
            winner = mutant if generation.uniforms[resident, 0, 0] < probability else resident
            parents[resident, 0] = winner
            parents[resident, 1] = ITSELF
            parents[mutant, 0] = winner
            parents[mutant, 1] = winner
        for single in range(2 * n_pairs, parents.shape[0]):
            parents[single, 0] = single
            parents[single, 1] = ITSELF


class LatticeSteps(Variation, name="lattice-steps"):
    """Copy of the first parent; each gene is one more or one less, with equal probability.

    References
    ----------
    Borenstein, Meilijson and Ruppin 2006.
    """

    @staticmethod
    def vary(part: Any, mating: Mating) -> None:
        child = mating.child
        for module in range(child.shape[0]):
            for gene in range(child.shape[1]):
                draw = mating.draws[module * child.shape[1] + gene, 0]
                step = np.float32(1) if draw < 0.5 else np.float32(-1)
                child[module, gene] = mating.fitter[module, gene] + step
