"""Recursion of a genetic algorithm with an infinite population of bit strings.

References
----------
.. [1] M. D. Vose and G. E. Liepins, "Punctuated equilibria in genetic search", Complex Systems 5
   (1991).
.. [2] D. Whitley, V. S. Gordon and K. Mathias, "Lamarckian evolution, the Baldwin effect and
   function optimization", PPSN III, LNCS 866 (1994).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Frequencies = npt.NDArray[np.float64]


def advance_frequencies(
    frequencies: Frequencies,
    fitness: npt.NDArray[np.float64],
    mutation_rate: float = 0.0,
    inherited: npt.NDArray[np.int64] | None = None,
) -> Frequencies:
    """Return the frequencies of all strings in the next generation.

    Both parents of a child are drawn in proportion to fitness, independently of each other. After
    a cut at a uniform position, the child has the first bits of one parent and the last bits of the
    other. Each bit then flips at the mutation rate. The parents are independent, so the frequency
    of a recombined string is the frequency of its first bits among the parents, multiplied by the
    frequency of its last bits.

    A string is a binary number, with the first bit as the highest digit. `inherited` contains the
    string that an agent transmits, by its string at birth: the learned one in Lamarck's theory.
    """
    n_strings = frequencies.size
    n_bits = n_strings.bit_length() - 1
    if n_strings < 4 or n_strings != 2**n_bits:
        raise ValueError(f"{n_strings} frequencies: their number must be 4, 8, 16, and so on")
    selected: Frequencies = frequencies * fitness / (frequencies @ fitness)
    if inherited is not None:
        transmitted = np.zeros(n_strings)
        np.add.at(transmitted, inherited, selected)
        selected = transmitted
    recombined = np.zeros(n_strings)
    for cut in range(1, n_bits):
        # [first bits, last bits]
        parents = selected.reshape(2**cut, -1)
        recombined += np.outer(parents.sum(axis=1), parents.sum(axis=0)).ravel() / (n_bits - 1)
    for bit in range(n_bits):
        # [earlier bits, bit, later bits]
        bits = recombined.reshape(2**bit, 2, -1)
        recombined = ((1 - mutation_rate) * bits + mutation_rate * bits[:, ::-1]).ravel()
    return recombined
