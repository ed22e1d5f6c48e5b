"""Exact recursion of strings that guess a needle, in an infinite population.

The alleles of different loci are independent, because recombination is free. The state is the
shares of the allele ? and of the wrong allele at each locus. Selection is in proportion to fitness.
"""

from __future__ import annotations

from math import inf

import numpy as np
import numpy.typing as npt

from baldwinlab.analysis.theory.needle import expected_fitness

Floats = npt.NDArray[np.float64]
LOCI = 20
BURN_IN = 500


def recur_share_of_unset(
    *,
    mutation_rate: float = 0.01,
    period: float = inf,
    redrawn_loci: int = 2,
    cost_of_trials: float = 1.0,
    generations: int = 2000,
) -> float:
    """Return the mean share of ? over the generations after `BURN_IN`."""
    fitness = np.array([expected_fitness(q, 1000, cost_of_trials) for q in range(LOCI + 1)])
    generator = np.random.default_rng(0)
    unset, wrong = np.full(LOCI, 0.2), np.full(LOCI, 0.005)
    shares = []
    for generation in range(generations):
        if period < inf and generation % period == 0:
            for locus in generator.integers(0, LOCI, redrawn_loci):
                if generator.random() < 0.5:
                    wrong[locus] = 1 - unset[locus] - wrong[locus]
        unset, wrong = (
            (1 - mutation_rate) * selected + mutation_rate / 3
            for selected in select_parents(unset, wrong, fitness)
        )
        shares.append(unset.mean())
    return float(np.mean(shares[BURN_IN:]))


def select_parents(unset: Floats, wrong: Floats, fitness: Floats) -> tuple[Floats, Floats]:
    """Return the shares [locus] of ? and of the wrong allele among the parents."""
    parents_unset, parents_wrong = np.empty(LOCI), np.empty(LOCI)
    for locus in range(LOCI):
        others = np.arange(LOCI) != locus
        # Whether no other allele is wrong, and the number of ? if none is.
        is_right = np.prod(1 - wrong[others])
        count = np.ones(1)
        for share in unset[others] / (1 - wrong[others]):
            count = np.convolve(count, [1 - share, share])
        of_right, of_unset = (
            1 + is_right * (count @ (values - 1)) for values in (fitness[:-1], fitness[1:])
        )
        right = 1 - unset[locus] - wrong[locus]
        # A string with a wrong allele has the fitness 1.
        mean = right * of_right + unset[locus] * of_unset + wrong[locus]
        parents_unset[locus] = unset[locus] * of_unset / mean
        parents_wrong[locus] = wrong[locus] / mean
    return parents_unset, parents_wrong
