"""Law of strings that climb a landscape: mutation sets the number of bits that learning changes.

References
----------
G. Mayley, "Landscapes, learning costs, and genetic assimilation", Evolutionary Computation 4
(1996).
"""

from __future__ import annotations

from math import inf


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
        Number T of trials in a lifetime. Infinite: learning finds each bit.

    Returns
    -------
    float
        Mean number of bits.
    """
    return float(bits * mutation_rate * (1 - (1 - 1 / bits) ** trials))
