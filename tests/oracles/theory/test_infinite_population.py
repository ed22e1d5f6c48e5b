"""The recursion of an infinite population equals a sum over all parents, cuts and mutations."""

from __future__ import annotations

from itertools import product

import numpy as np
import numpy.typing as npt
import pytest

from tests.oracles.theory.infinite_population import advance_frequencies

Numbers = npt.NDArray[np.float64]


def advance_naively(
    frequencies: Numbers, fitness: Numbers, mutation_rate: float, inherited: list[int]
) -> list[float]:
    """Sum the probabilities of all pairs of parents, cuts, orders and mutations."""
    strings = list(product("01", repeat=frequencies.size.bit_length() - 1))
    n_bits = len(strings[0])
    mean_fitness = sum(f * w for f, w in zip(frequencies, fitness, strict=True))
    children = dict.fromkeys(strings, 0.0)
    for first, second in product(range(len(strings)), repeat=2):
        probability = frequencies[first] * fitness[first] * frequencies[second] * fitness[second]
        pair = strings[inherited[first]], strings[inherited[second]]
        for (head, tail), cut in product((pair, pair[::-1]), range(1, n_bits)):
            recombined = head[:cut] + tail[cut:]
            for child in strings:
                n_flips = sum(a != b for a, b in zip(recombined, child, strict=True))
                mutation = mutation_rate**n_flips * (1 - mutation_rate) ** (n_bits - n_flips)
                children[child] += probability * mutation / mean_fitness**2 / (2 * (n_bits - 1))
    return list(children.values())


@pytest.mark.parametrize("mutation_rate", [0.0, 0.07])
@pytest.mark.parametrize("bits", [2, 4])
def test_the_recursion_equals_the_naive_sum(bits: int, mutation_rate: float) -> None:
    generator = np.random.default_rng(bits)
    for _ in range(3):
        frequencies = generator.dirichlet(np.ones(2**bits))
        fitness = generator.uniform(0, 2, 2**bits)
        inherited = generator.integers(0, 2**bits, 2**bits)
        naive = advance_naively(frequencies, fitness, mutation_rate, inherited.tolist())
        result = advance_frequencies(frequencies, fitness, mutation_rate, inherited)
        assert np.abs(result - naive).max() < 1e-12
        # Without learning, a string is transmitted unchanged.
        naive = advance_naively(frequencies, fitness, mutation_rate, list(range(2**bits)))
        result = advance_frequencies(frequencies, fitness, mutation_rate)
        assert np.abs(result - naive).max() < 1e-12


def test_two_bits_that_always_recombine_are_independent_after_a_generation() -> None:
    """The linkage disequilibrium D = p(11) p(00) - p(10) p(01) is multiplied by 1 - r; r = 1."""
    frequencies = np.array([0.4, 0.1, 0.2, 0.3])
    children = advance_frequencies(frequencies, np.ones(4))
    assert children[0] * children[3] - children[1] * children[2] == pytest.approx(0, abs=1e-15)
    # The frequencies of the alleles do not change.
    assert children[2] + children[3] == pytest.approx(0.5)
    assert children[1] + children[3] == pytest.approx(0.4)


def test_mutation_at_a_half_gives_all_strings_the_same_frequency() -> None:
    frequencies = np.array([0.7, 0.1, 0.1, 0, 0, 0, 0, 0.1])
    assert advance_frequencies(frequencies, np.arange(8.0) + 1, 0.5) == pytest.approx(1 / 8)


def test_a_number_of_strings_that_is_no_power_of_two_is_refused() -> None:
    with pytest.raises(ValueError, match="6 frequencies: their number must be 4, 8, 16"):
        advance_frequencies(np.full(6, 1 / 6), np.ones(6))
