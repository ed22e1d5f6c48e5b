"""Chain of strong selection and weak mutation against matrix powers, enumeration and simulation."""

from __future__ import annotations

from itertools import product
from math import comb

import numpy as np
import numpy.typing as npt
import pytest

from baldwinlab.analysis.theory.landscape_chain import (
    ChainSettings,
    advance,
    compute_advantages,
    compute_fixation,
    learn,
    list_neighbors,
    make_chain,
)

Floats = npt.NDArray[np.float64]
BITS = 4
FITNESS = np.random.default_rng(3).uniform(size=2**BITS)


def enumerate_deaths(birth: int, trials: int) -> Floats:
    """Return the probabilities of the strings at death from all sequences of flipped bits."""
    shares = np.zeros(2**BITS)
    sequences = [*product(range(BITS), repeat=trials)]
    for sequence in sequences:
        string = birth
        for bit in sequence:
            flipped = string ^ (1 << bit)
            if FITNESS[flipped] > FITNESS[string]:
                string = flipped
        shares[string] += 1 / len(sequences)
    return shares


@pytest.mark.parametrize("trials", [0, 1, 2, 5])
def test_learning_equals_all_sequences_of_trials(trials: int) -> None:
    outcome = learn(FITNESS, trials).toarray()
    for birth in range(2**BITS):
        assert np.allclose(outcome[birth], enumerate_deaths(birth, trials))


@pytest.mark.parametrize("trials", [0, 1, 3])
def test_the_advantage_equals_all_pairs_of_deaths(trials: int) -> None:
    advantages = compute_advantages(FITNESS, trials)
    signs = np.sign(FITNESS[:, None] - FITNESS)  # [mutant, resident].
    for resident, bit in product(range(2**BITS), range(BITS)):
        mutant = resident ^ (1 << bit)
        pairs = np.outer(enumerate_deaths(mutant, trials), enumerate_deaths(resident, trials))
        assert advantages[resident, bit] == pytest.approx((pairs * signs).sum())


def test_equal_strings_have_no_advantage() -> None:
    fitness = np.array([0.0, 1.0, 1.0, 0.0])
    assert np.array_equal(compute_advantages(fitness)[1], [-1, -1])
    assert np.array_equal(compute_advantages(np.ones(4)), np.zeros((4, 2)))


@pytest.mark.parametrize("agents", [2, 10, 50])
def test_fixation_equals_powers_of_the_matrix_of_sampling(agents: int) -> None:
    """Two agents at random in each tournament, and the number of mutants is binomial."""
    for advantage in (-0.5, 0.0, 0.25, 1.0):
        step = np.zeros((agents + 1, agents + 1))
        for count in range(agents + 1):
            share = count / agents
            # Both are mutants; or one is, and it wins with the probability (1 + s) / 2.
            mean = share**2 + 2 * share * (1 - share) * (1 + advantage) / 2
            for following in range(agents + 1):
                ways = comb(agents, following)
                step[count, following] = ways * mean**following * (1 - mean) ** (agents - following)
        fixed = np.linalg.matrix_power(step, 2**14)[1, agents]
        assert compute_fixation(np.array(advantage), agents) == pytest.approx(fixed, rel=1e-6)
    assert compute_fixation(np.array(0.0), agents) == pytest.approx(1 / agents)


def test_the_chain_equals_powers_of_a_matrix_built_string_by_string() -> None:
    settings = ChainSettings(agents=20, mutation_rate=0.001, trials=2)
    matrix = np.zeros((2**BITS, 2**BITS))
    advantages = compute_advantages(FITNESS, 2)
    for string, bit in product(range(2**BITS), range(BITS)):
        single_mutants = 20 * 0.001 * 0.999 ** (BITS - 1)
        fixation = float(compute_fixation(advantages[string, bit], 20))
        matrix[string, list_neighbors(BITS)[string, bit]] = single_mutants * fixation
    matrix += np.diag(1 - matrix.sum(axis=1))
    chain = make_chain(FITNESS, settings)
    assert np.allclose(chain.toarray(), matrix)
    start = np.zeros(2**BITS)
    start[5] = 1
    expected = start @ np.linalg.matrix_power(matrix, 300)
    assert np.allclose(advance(chain, start, 300), expected)


def simulate_substitutions(settings: ChainSettings, start: int, generations: int) -> Floats:
    """Return the shares of the genotypes of 4,000 populations, each change drawn at random."""
    generator = np.random.default_rng(8)
    matrix = make_chain(FITNESS, settings).toarray().cumsum(axis=1)
    strings = np.full(4000, start)
    for _ in range(generations):
        strings = (matrix[strings] < generator.uniform(size=(strings.size, 1))).sum(axis=1)
    return np.bincount(strings, minlength=2**BITS) / strings.size


def test_the_chain_agrees_with_simulated_substitutions() -> None:
    settings = ChainSettings(agents=20, mutation_rate=0.002)
    start = np.zeros(2**BITS)
    start[5] = 1
    simulated = simulate_substitutions(settings, 5, 100)
    assert np.abs(advance(make_chain(FITNESS, settings), start, 100) - simulated).max() < 0.03


def test_populations_without_mutation_stay_and_all_climb_to_a_single_peak() -> None:
    peak = np.array([bin(string).count("1") for string in range(2**BITS)], np.float64)
    start = np.eye(2**BITS)[0]
    still = advance(make_chain(peak, ChainSettings(50, 0.0)), start, 100)
    assert still[0] == 1
    final = advance(make_chain(peak, ChainSettings(50, 0.001)), start, 5000)
    assert final[-1] > 0.999
