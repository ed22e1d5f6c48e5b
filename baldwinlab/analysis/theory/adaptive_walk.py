"""Probability that a mutant replaces a population, in the process of Moran.

References
----------
P. A. P. Moran, "Random processes in genetics", Mathematical Proceedings of the Cambridge
Philosophical Society 54 (1958).
"""

from __future__ import annotations

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
        Probabilities. 0 for a mutant without fitness.
    """
    mutant, resident = np.broadcast_arrays(mutant, resident)
    with np.errstate(over="ignore"):
        ratios = np.divide(resident, mutant, out=np.zeros(mutant.shape), where=mutant > 0)
        total = np.ones(mutant.shape)
        for _ in range(members - 1):
            total = 1 + ratios * total
    return np.where(mutant > 0, 1 / total, 0.0)
