"""A mutant replaces a population with its probability of fixation."""

from __future__ import annotations

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.analysis.theory.adaptive_walk import compute_fixation_probabilities
from baldwinlab.evolution import GenerationKey, breed
from baldwinlab.experiment import assign
from baldwinlab.models.lattice_walkers.breeding import (
    fixation_probability,
)


@pytest.mark.parametrize("members", [1, 2, 10])
def test_the_compiled_probability_agrees_with_theory(members: int) -> None:
    generator = np.random.default_rng(members)
    mutant, resident = generator.uniform(0, 3, (2, 50))
    mutant[0] = 0
    expected = compute_fixation_probabilities(mutant, resident, members)
    result = [fixation_probability(*pair, members) for pair in zip(mutant, resident, strict=True)]
    assert result == pytest.approx(expected.tolist(), rel=1e-13)


@pytest.mark.parametrize("mutant_fitness", [0.0, 0.9, 1.0, 1.3])
def test_mutants_replace_their_population_as_often_as_expected(mutant_fitness: float) -> None:
    pairs = 20_000
    experiment = assign(bl.load("fixed-walk/slope"), [f"population.size={2 * pairs}"])
    # The populations are at position 0, and their mutants at position 5.
    genomes = np.tile(np.array([0, 5], np.float32), pairs)[:, None, None]
    fitness = np.tile([1.0, mutant_fitness], pairs)
    children, parents = breed(experiment, genomes, fitness, GenerationKey(1, 0, 1))
    populations, mutants = children[::2, 0, 0], children[1::2, 0, 0]
    assert set(np.unique(populations)) <= {0, 5}
    # Each pair is separate, and a mutant is one step from its population.
    assert (parents // 2 == np.arange(2 * pairs)[:, None] // 2).all()
    assert (np.abs(mutants - populations) == 1).all()
    probability = float(compute_fixation_probabilities(np.array(mutant_fitness), np.array(1.0), 10))
    error = np.sqrt(probability * (1 - probability) / pairs)
    assert abs((populations == 5).mean() - probability) <= 4 * error
    assert abs((mutants > populations).mean() - 0.5) < 4 * 0.5 / np.sqrt(pairs)
