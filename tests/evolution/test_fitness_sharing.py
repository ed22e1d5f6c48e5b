"""Fitness sharing agrees with theory."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.stats import binomtest

from baldwinlab.experiment import ExperimentError
from baldwinlab.papers.presets import load
from baldwinlab.parts.lifetimes import make_lifetimes
from tests.evolution.draws import (
    ERROR_RATE,
    count_parents,
    draw_parents,
    require_frequencies,
    use_selection,
)


def count_sharing_parents(
    genome: npt.NDArray[np.float32], fitness: Any, **settings: Any
) -> npt.NDArray[np.int64]:
    """Return how often each agent is a parent in many rounds."""
    experiment = use_selection("fitness-sharing", settings)
    counts = count_parents(experiment, fitness, 300, make_lifetimes(genome))
    return np.asarray(counts.sum(axis=0))


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
    counts = count_sharing_parents(make_niches(*sizes), fitness)
    n_in_first_niche = int(counts[: sizes[0]].sum())
    assert binomtest(n_in_first_niche, int(counts.sum()), 3 / 4).pvalue > ERROR_RATE


def test_without_neighbors_the_selection_is_roulette() -> None:
    fitness = np.array([3.0, 1.0, 4.0, 0.0])
    counts = count_sharing_parents(make_niches(1, 1, 1, 1), fitness)
    require_frequencies(counts, fitness)


@pytest.mark.parametrize(("exponent", "shared"), [(1, 0.75), (2, 0.9375)])
def test_two_agents_share_by_their_distance(exponent: int, shared: float) -> None:
    """All genes differ by 1, so the distance is 1 and a quarter of the radius."""
    genome = np.zeros((3, 2, 3), np.float32)
    genome[1] = 1
    genome[2] = 100
    counts = count_sharing_parents(genome, np.ones(3), radius=4.0, exponent=exponent)
    require_frequencies(counts, [1 / (1 + shared), 1 / (1 + shared), 1])


def test_a_negative_fitness_and_graphs_are_refused() -> None:
    with pytest.raises(ValueError, match="the fitness of agent 1 is -1 and must be 0 or more"):
        draw_parents(use_selection("fitness-sharing"), [1.0, -1.0])
    with pytest.raises(ExperimentError, match=r"choose evolution\.selection = .species."):
        load("neat-xor").replace(evolution={"selection": "fitness-sharing"})
