"""Laws of populations that climb a landscape: fixation of a mutant, and supply by mutation.

References
----------
.. [1] P. A. P. Moran, "Random processes in genetics", Mathematical Proceedings of the Cambridge
   Philosophical Society 54 (1958).
.. [2] G. Mayley, "Landscapes, learning costs, and genetic assimilation", Evolutionary Computation 4
   (1996).
"""

from __future__ import annotations

from math import inf

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


def compute_fixation_probabilities(mutant: Floats, resident: Floats, members: int) -> Floats:
    """Return the probabilities that one mutant replaces a population, in the process of Moran.

    The probability is 1 / (1 + x + ... + x^(members - 1)), where x = resident / mutant. It is
    1 / members for equal fitness.

    Parameters
    ----------
    mutant, resident : array
        Fitness of the mutant and of the other members, at least 0.
    members : int
        Number of members of the population.

    Returns
    -------
    array
        Probabilities. A mutant without fitness has the probability 0.
    """
    mutant, resident = np.broadcast_arrays(mutant, resident)
    with np.errstate(over="ignore"):
        ratios = np.divide(resident, mutant, out=np.zeros(mutant.shape), where=mutant > 0)
        total = np.ones(mutant.shape)
        # Each step appends a term of the sum 1 + x + ... + x^(members - 1).
        for _ in range(members - 1):
            total = 1 + ratios * total
    return np.where(mutant > 0, 1 / total, 0.0)


def mutation_supply(bits: int, mutation_rate: float, trials: float = inf) -> float:
    """Return the mean number of mutated bits of a newborn that learning restores.

    The parents are at a peak of a landscape without epistasis (K = 0). Each bit mutates with the
    probability mu, and a trial flips it with the probability 1 / N, so T trials restore
    mu N (1 - (1 - 1 / N)^T) bits. Learning cannot change fewer bits in the long run, because
    mutation creates new errors in each generation.

    Parameters
    ----------
    bits : int
        Number N of bits.
    mutation_rate : float
        Probability mu of a flip per bit and birth.
    trials : float
        Number T of trials in a lifetime. If it is infinite, learning restores every bit.

    Returns
    -------
    float
        Mean number of bits.
    """
    return float(bits * mutation_rate * (1 - (1 - 1 / bits) ** trials))
