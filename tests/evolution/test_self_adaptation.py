"""The variation `self-adaptive` converges on the sphere function."""

from __future__ import annotations

import numpy as np

from baldwinlab.evolution import GenerationKey, breed, draw_genomes
from baldwinlab.evolution.rng_key import Genome
from baldwinlab.experiment import Experiment
from tests.worlds import make_small_experiment

GENERATIONS = 150


def sphere_experiment(variation: str) -> Experiment:
    return make_small_experiment(
        "evo",
        population={"size": 40},
        network={"hidden": []},
        evolution={"variation": variation, "selection": "truncation"},
    )


def squared_distances(experiment: Experiment, genome: Genome) -> np.ndarray:
    """Return the squared distance of the weights from 0, [agent]."""
    weights = genome[:, 0, : experiment.weight_count].astype(float)
    return np.asarray((weights**2).sum(axis=1))


def minimize_sphere(experiment: Experiment) -> tuple[float, Genome]:
    """Return the smallest squared distance of the last generation, and its genomes."""
    genome = draw_genomes(experiment, GenerationKey(1, 0, 0))
    for generation in range(1, GENERATIONS + 1):
        fitness = -squared_distances(experiment, genome)
        genome, _ = breed(experiment, genome, fitness, GenerationKey(1, 0, generation))
    return float(squared_distances(experiment, genome).min()), genome


def test_step_sizes_adapt_so_that_populations_converge_further_than_with_a_fixed_step() -> None:
    adaptive = sphere_experiment("self-adaptive")
    distance, genome = minimize_sphere(adaptive)
    fixed = sphere_experiment("gaussian").replace(
        evolution={"mutation_rate": 1.0, "mutation_size": 0.1}
    )
    fixed_distance, _ = minimize_sphere(fixed)
    assert distance < fixed_distance / 10
    assert np.median(genome[:, 0, adaptive.gene_index("step_size")]) < 0.02
