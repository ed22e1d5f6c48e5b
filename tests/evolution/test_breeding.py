"""Founders and children of a generation, and single mutants."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import kstest

import baldwinlab as bl
from baldwinlab.evolution import GenerationKey
from baldwinlab.evolution.breeding import make_single_mutants
from baldwinlab.experiment import BaseExperiment
from baldwinlab.papers.presets import load
from baldwinlab.simulation.simulate import simulate
from tests.evolution.single_runs import breed, draw_genomes
from tests.worlds import make_small_experiment

CONDITIONS = [
    "evo+self-taught/A",
    "evo+evolved-rate/A",
    "hinton-nowlan-1987:guessing",
    "mayley-1996:climbing/smooth",
    "paenke-2007:stepping/convex",
    "nolfi-elman-parisi-1994:predicting",
    "todd-miller-1991:hebbian/smell-55",
    "suzuki-arita-2004:meta-pavlov",
]
KEY = GenerationKey(seed=1, run=0, generation=7)


def test_initial_weights_are_standard_normal_and_independent_between_modules() -> None:
    experiment = load("evo+self-taught/A").replace(population={"size": 300})
    genome = draw_genomes(experiment, GenerationKey(1, 2, 0))
    assert genome.shape == (300, 2, 60)
    for module in range(2):
        assert kstest(genome[:, module].ravel(), "norm").pvalue > 0.001
        assert kstest(genome[:, module].mean(axis=0) * np.sqrt(300), "norm").pvalue > 0.001
        assert kstest(genome[:, module].mean(axis=1) * np.sqrt(60), "norm").pvalue > 0.001
    assert abs(np.corrcoef(genome[:, 0].ravel(), genome[:, 1].ravel())[0, 1]) < 4 / np.sqrt(
        genome[:, 0].size
    )


def test_a_generation_is_bred_from_the_genomes_and_energy_of_the_previous_generation() -> None:
    experiment = make_small_experiment(
        "evo+self-taught",
        world={"food": [{"x": [20, 100], "y": [10, 90], "count": 12, "energy": 2.5}]},
    )
    result = simulate(experiment, seed=3, run=4)
    genome = result["genome"].values
    energy = result["energy"].values
    assert (result["parents"].values[0] == -1).all()
    assert (energy == 2.5 * result["food_eaten"].values).all()
    for generation in (1, 2):
        children, parents = breed(
            experiment,
            genome[generation - 1],
            energy[generation - 1],
            GenerationKey(3, 4, generation),
        )
        np.testing.assert_array_equal(children, genome[generation])
        np.testing.assert_array_equal(parents, result["parents"].values[generation])


def population(condition: str, size: int = 200) -> tuple[BaseExperiment, np.ndarray]:
    experiment = bl.load(condition).replace(population={"size": size})
    return experiment, draw_genomes(experiment, KEY._replace(generation=0))


@pytest.mark.parametrize("condition", CONDITIONS)
def test_a_mutant_differs_from_its_agent_in_one_gene(condition: str) -> None:
    experiment, genome = population(condition)
    before = genome.copy()
    mutants = make_single_mutants(experiment, KEY, genome)
    n_changed = (mutants != genome).sum(axis=(1, 2))
    assert np.array_equal(genome, before)
    assert (n_changed == 1).mean() > 0.9
    assert n_changed.max() == 1


def test_every_gene_mutates_with_equal_probability() -> None:
    experiment, genome = population("mayley-1996:climbing/smooth", 16_000)
    mutants = make_single_mutants(experiment, KEY, genome)
    counts = (mutants != genome).sum(axis=(0, 1))
    # 1,000 of each of 16 bits are expected, with a standard deviation of 31.
    assert counts.sum() == 16_000
    assert abs(counts - 1000).max() < 150


def test_mutations_have_the_size_of_the_experiment() -> None:
    experiment, genome = population("paenke-2007:stepping/convex", 4000)
    changes = make_single_mutants(experiment, KEY, genome) - genome
    assert changes.std() == pytest.approx(experiment.evolution.mutation_size, rel=0.05)


def test_a_mutation_of_size_0_is_no_mutation() -> None:
    experiment, genome = population("evo/A")
    changed = experiment.replace(evolution={"mutation_size": 0.0})
    assert np.array_equal(make_single_mutants(changed, KEY, genome), genome)
