"""Selection on the elements of a trait that are innate, plastic or wrong.

A trait has several elements. Learning sets a plastic element i right with the probability p_i if
its prerequisite is right, and never otherwise. Fitness is the sum of the weights of all right
elements.

References
----------
.. [1] T. J. H. Morgan, J. W. Suchow and T. L. Griffiths, "What the Baldwin effect affects depends
   on the nature of plasticity", Cognition 197 (2020).
.. [2] G. E. Hinton and S. J. Nowlan, "How learning can guide evolution", Complex Systems 1 (1987).
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
INNATE: Final = 0
PLASTIC: Final = 1
WRONG: Final = 2


class Elements(NamedTuple):
    """Elements of a trait.

    Attributes
    ----------
    success_probabilities : array of shape (element,)
        Probability that learning sets a plastic element right, if its prerequisite is right.
    weights : array of shape (element,)
        Contribution of each element to fitness, if it is right.
    prerequisites : sequence of int
        Number of the element that an element needs, from 1, or 0 for none. An element needs only
        elements with smaller numbers.
    """

    success_probabilities: npt.ArrayLike
    weights: npt.ArrayLike
    prerequisites: tuple[int, ...]


def compute_carrier_fitness(shares: Floats, elements: Elements) -> Floats:
    """Return the mean fitness of the carriers of each allele.

    Without linkage, the states of the other elements do not depend on the allele. An element is
    right with the probability R_i = a_i + b_i p_i R_j, with the frequencies a_i and b_i of the
    innate and of the plastic allele, and the prerequisite j. A right element is worth V_i = w_i +
    the sum of b_k p_k V_k over the elements k that need i. Fitness is linear in each element.
    Therefore the carriers of an allele with the probability r of a right element have the mean
    fitness W + (r - R_i) V_i, where W is the sum of w_i R_i.
    """
    success = np.asarray(elements.success_probabilities, np.float64)
    weights = np.asarray(elements.weights, np.float64)
    # [allele, element]: probability that an element with this allele is right.
    right = np.stack([np.ones_like(success), success, np.zeros_like(success)])
    all_right = shares[INNATE].copy()
    for element, prerequisite in enumerate(elements.prerequisites):
        right[PLASTIC, element] *= all_right[prerequisite - 1] if prerequisite else 1
        all_right[element] += shares[PLASTIC, element] * right[PLASTIC, element]
    values = weights.copy()
    # An element has a larger number than its prerequisite.
    for element in reversed(range(len(values))):
        prerequisite = elements.prerequisites[element]
        if prerequisite:
            needed_share = shares[PLASTIC, element] * success[element]
            values[prerequisite - 1] += needed_share * values[element]
    fitness: Floats = weights @ all_right + (right - all_right) * values
    return fitness


def predict_selection(elements: Elements) -> Floats:
    """Return the selection on an innate allele of each element of a plastic trait.

    It is the mean fitness with this element innately right, minus that with all elements plastic:
    (1 - p_i R_j) V_i. Without prerequisites, it is w_i (1 - p_i).
    """
    shares = np.zeros((3, len(elements.prerequisites)))
    shares[PLASTIC] = 1
    fitness = compute_carrier_fitness(shares, elements)
    selection: Floats = fitness[INNATE] - fitness[PLASTIC]
    return selection


def advance_shares(shares: Floats, elements: Elements, mutation_rate: float = 0.0) -> Floats:
    """Return the frequencies of alleles after one generation of an infinite population.

    `shares`: frequencies [allele, element]. Selection is proportional to fitness, and each allele
    of a child comes from a separate parent. A mutation draws the three alleles equally often.
    """
    selected = shares * compute_carrier_fitness(shares, elements)
    selected /= selected.sum(axis=0)
    return (1 - mutation_rate) * selected + mutation_rate / 3
