"""Test the laws of plastic elements against their limits and against all genomes and outcomes."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from tests.oracles.theory.element_selection import (
    INNATE,
    PLASTIC,
    WRONG,
    Elements,
    advance_shares,
    compute_carrier_fitness,
    predict_selection,
)

Floats = npt.NDArray[np.float64]


def make_cases(n_cases: int, n_elements: int) -> Iterator[tuple[Elements, Floats]]:
    """Yield random elements, and random shares of their alleles [allele, element]."""
    generator = np.random.default_rng(n_elements)
    for _ in range(n_cases):
        prerequisites = tuple(int(generator.integers(0, i + 1)) for i in range(n_elements))
        elements = Elements(
            generator.random(n_elements), generator.exponential(size=n_elements), prerequisites
        )
        yield elements, generator.dirichlet(np.ones(3), n_elements).T


def enumerate_fitness(genome: Any, elements: Elements) -> float:
    """Return the mean fitness of one genome over all outcomes of learning."""
    success: Any = elements.success_probabilities
    weights: Any = elements.weights
    total = 0.0
    for outcome in product((0, 1), repeat=len(genome)):
        probability = 1.0
        right: list[bool] = []
        for allele, drawn, chance, prerequisite in zip(
            genome, outcome, success, elements.prerequisites, strict=True
        ):
            probability *= chance if drawn else 1 - chance
            has_prerequisite = prerequisite == 0 or right[prerequisite - 1]
            is_learned = allele == PLASTIC and drawn == 1 and has_prerequisite
            right.append(allele == INNATE or is_learned)
        total += probability * sum(
            weight for weight, is_right in zip(weights, right, strict=True) if is_right
        )
    return total


def enumerate_carriers(shares: Floats, elements: Elements) -> Floats:
    """Return the mean fitness of the carriers of each allele, from all genomes."""
    n_elements = shares.shape[1]
    sums = np.zeros((3, n_elements))
    for genome in product((INNATE, PLASTIC, WRONG), repeat=n_elements):
        fitness = enumerate_fitness(genome, elements)
        probabilities = [shares[allele, element] for element, allele in enumerate(genome)]
        for element, allele in enumerate(genome):
            background = np.prod(probabilities[:element] + probabilities[element + 1 :])
            sums[allele, element] += background * fitness
    return sums


@pytest.mark.parametrize("n_elements", [1, 2, 4])
def test_the_fitness_of_carriers_is_exact(n_elements: int) -> None:
    for elements, shares in make_cases(6, n_elements):
        exact = enumerate_carriers(shares, elements)
        assert np.allclose(compute_carrier_fitness(shares, elements), exact, rtol=0, atol=1e-12)


def test_the_next_shares_are_those_of_all_selected_genomes() -> None:
    """Shares of alleles among parents that are drawn in proportion to fitness."""
    for elements, shares in make_cases(6, 3):
        parents = np.zeros_like(shares)
        for genome in product((INNATE, PLASTIC, WRONG), repeat=3):
            probability = np.prod([shares[allele, i] for i, allele in enumerate(genome)])
            for element, allele in enumerate(genome):
                parents[allele, element] += probability * enumerate_fitness(genome, elements)
        parents /= parents.sum(axis=0)
        assert np.allclose(advance_shares(shares, elements), parents, rtol=0, atol=1e-12)
        mutated = 0.9 * parents + 0.1 / 3
        assert np.allclose(advance_shares(shares, elements, 0.1), mutated, rtol=0, atol=1e-12)


def test_selection_without_prerequisites_is_weight_times_probability_of_failure() -> None:
    success = np.array([0.0, 0.3, 0.9, 1.0])
    weights = np.array([2.0, 1.0, 3.0, 5.0])
    selection = predict_selection(Elements(success, weights, (0, 0, 0, 0)))
    assert selection == pytest.approx(weights * (1 - success), abs=1e-12)
    assert selection[3] == 0, "an element that is always learned is not selected"


def test_an_element_has_the_selection_of_the_elements_that_need_it() -> None:
    """The first element is needed by two others: f1 (1 - p1) + sum of f_j p_j (1 - p1)."""
    success, weights = (0.4, 0.5, 0.8), (1.0, 2.0, 3.0)
    selection = predict_selection(Elements(success, weights, (0, 1, 1)))
    assert selection[0] == pytest.approx(0.6 * (1.0 + 2.0 * 0.5 + 3.0 * 0.8), abs=1e-12)
    # The others are learned only if the first element is learned.
    assert selection[1] == pytest.approx(2.0 * (1 - 0.4 * 0.5), abs=1e-12)


def test_the_middle_of_a_chain_has_the_largest_selection() -> None:
    """Early elements are easier to learn, and late elements are needed by fewer others."""
    chain = Elements([0.5] * 8, [1.0] * 8, tuple(range(8)))
    selection = predict_selection(chain)
    # (1 - 2^-i) (2 - 2^-(8 - i)) is symmetric.
    expected = [(1 - 0.5**i) * (2 - 0.5 ** (8 - i)) for i in range(1, 9)]
    assert selection == pytest.approx(expected, abs=1e-12)
    assert selection == pytest.approx(selection[::-1], abs=1e-12)
    assert selection.argmax() in (3, 4) and selection.argmin() in (0, 7)


def test_shares_do_not_change_if_all_alleles_are_equally_good() -> None:
    shares = np.array([[0.2], [0.8], [0.0]])
    always_learned = Elements([1.0], [3.0], (0,))
    assert advance_shares(shares, always_learned) == pytest.approx(shares, abs=1e-15)
