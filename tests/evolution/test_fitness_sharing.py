"""Fitness sharing agrees with theory."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.stats import binomtest, chisquare

from baldwinlab.engine import rng
from baldwinlab.evolution import GenerationKey, Parents, select
from baldwinlab.experiment import Experiment, ExperimentError
from baldwinlab.papers.presets import load
from baldwinlab.parts.lifetimes import make_lifetimes

ROUNDS = 300


def share_fitness(**settings: Any) -> Experiment:
    experiment: Experiment = load("evo/A").replace(
        evolution={"selection": "fitness-sharing", "fitness_sharing": settings}
    )
    return experiment


def draw_parents(
    experiment: Experiment, genome: npt.NDArray[np.float32], fitness: Any, generation: int
) -> Parents:
    key = GenerationKey(5, 0, generation)
    uniforms = key.uniforms(rng.SELECTION, (len(genome), 2))
    return select(experiment, np.asarray(fitness, float), uniforms, make_lifetimes(genome), key)


def count_parents(
    genome: npt.NDArray[np.float32], fitness: Any, **settings: Any
) -> npt.NDArray[np.int64]:
    """Return how often each agent is a parent in many rounds."""
    experiment = share_fitness(**settings)
    draws = [
        draw_parents(experiment, genome, fitness, generation).ravel()
        for generation in range(1, ROUNDS + 1)
    ]
    return np.bincount(np.concatenate(draws), minlength=len(genome))


def make_niches(*sizes: int) -> npt.NDArray[np.float32]:
    """Return genomes of niches of identical agents, with distances of 10 between the niches."""
    niche = np.repeat(np.arange(len(sizes)), sizes)
    return np.tile(10.0 * niche[:, None, None], (1, 2, 3)).astype(np.float32)


@pytest.mark.parametrize("sizes", [(4, 12), (12, 4), (8, 8)])
def test_niches_have_children_in_proportion_to_their_fitness_and_not_to_their_size(
    sizes: tuple[int, int],
) -> None:
    """The equilibrium of Goldberg and Richardson: the size of a niche follows its fitness."""
    fitness = np.repeat([3.0, 1.0], sizes)
    counts = count_parents(make_niches(*sizes), fitness)
    n_in_first_niche = int(counts[: sizes[0]].sum())
    assert binomtest(n_in_first_niche, int(counts.sum()), 3 / 4).pvalue > 0.001


def test_without_neighbors_the_selection_is_roulette() -> None:
    fitness = np.array([3.0, 1.0, 4.0, 0.0])
    counts = count_parents(make_niches(1, 1, 1, 1), fitness)
    assert counts[3] == 0
    assert chisquare(counts[:3], fitness[:3] / fitness.sum() * counts.sum()).pvalue > 0.001


@pytest.mark.parametrize(("exponent", "shared"), [(1, 0.75), (2, 0.9375)])
def test_two_agents_share_by_their_distance(exponent: int, shared: float) -> None:
    """All genes differ by 1, so the distance is 1 and a quarter of the radius."""
    genome = np.zeros((3, 2, 3), np.float32)
    genome[1] = 1
    genome[2] = 100
    counts = count_parents(genome, np.ones(3), radius=4.0, exponent=exponent)
    shares = np.array([1 / (1 + shared), 1 / (1 + shared), 1])
    assert chisquare(counts, shares / shares.sum() * counts.sum()).pvalue > 0.001


def test_a_negative_fitness_and_graphs_are_refused() -> None:
    with pytest.raises(ValueError, match="the fitness of agent 1 is -1 and must be 0 or more"):
        draw_parents(share_fitness(), make_niches(1, 1), [1.0, -1.0], 1)
    with pytest.raises(ExperimentError, match=r"choose evolution\.selection = .species."):
        load("neat-xor").replace(evolution={"selection": "fitness-sharing"})
