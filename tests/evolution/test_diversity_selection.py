"""Lexicase selection and fitness sharing agree with theory."""

from __future__ import annotations

from itertools import permutations
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.stats import binomtest

from baldwinlab.experiment import ExperimentError
from baldwinlab.models.gain_functions import SlopeClimbers
from baldwinlab.papers.presets import load
from baldwinlab.parts.lifetimes import Lifetimes, make_lifetimes
from baldwinlab.simulation.simulate import simulate
from tests.evolution.draws import (
    ERROR_RATE,
    count_parents,
    draw_parents,
    require_frequencies,
    use_selection,
)
from tests.worlds import make_small_experiment

EXPERIMENT = use_selection("lexicase")


def count_lexicase_parents(lifetimes: Lifetimes) -> npt.NDArray[np.int64]:
    """Return how often each agent is a parent in many rounds."""
    fitness = np.zeros(len(lifetimes.energy))
    return np.asarray(count_parents(EXPERIMENT, fitness, 400, lifetimes).sum(axis=0))


def selection_probabilities(cases: Any) -> npt.NDArray[np.float64]:
    """Return the exact probability of each agent, from all orders of the cases [case][agent].

    Source: W. La Cava, T. Helmuth, L. Spector and J. H. Moore, "A probabilistic and multi-objective
    analysis of lexicase selection", Evolutionary Computation 27 (2019).
    """
    probabilities = np.zeros(len(cases[0]))
    orders = list(permutations(cases))
    for order in orders:
        candidates = list(range(len(probabilities)))
        for case in order:
            best = max(case[agent] for agent in candidates)
            candidates = [agent for agent in candidates if case[agent] == best]
        probabilities[candidates] += 1 / (len(orders) * len(candidates))
    return probabilities


def make_cases(eaten: Any, **records: Any) -> Lifetimes:
    """Return lifetimes with the eaten items [region][agent] and records [agent]."""
    n_agents = len(eaten[0])
    return make_lifetimes(
        np.zeros((n_agents, 1, 1), np.float32),
        eaten=np.array(eaten, np.int32).T,
        records={name: np.array(values, np.float32) for name, values in records.items()},
    )


@pytest.mark.parametrize(
    ("eaten", "records"),
    [
        (
            [[5, 0, 3, 5, 0, 2], [0, 5, 3, 0, 5, 2]],
            {"distance": [1, 1, 9, 2, 1, 2], "age": [4, 4, 4, 4, 4, 9]},
        ),
        # Agent 2 has the highest mean and is never a parent.
        ([[9, 0, 8], [0, 9, 8]], {}),
        # The first three agents are equal.
        ([[3, 3, 3, 1]], {}),
    ],
)
def test_the_frequencies_of_parents_equal_the_exact_probabilities(
    eaten: list[list[int]], records: dict[str, list[int]]
) -> None:
    expected = selection_probabilities([*eaten, *records.values()])
    counts = count_lexicase_parents(make_cases(eaten, **records))
    require_frequencies(counts, expected)


def test_a_record_without_a_value_is_the_lowest_value() -> None:
    nothing = [[0, 0, 0]]
    counts = count_lexicase_parents(make_cases(nothing, distance=[np.nan, -5.0, np.nan]))
    assert counts.tolist() == [0, counts.sum(), 0]
    all_missing = count_lexicase_parents(make_cases(nothing, distance=[np.nan] * 3))
    require_frequencies(all_missing, np.ones(3))


def test_the_parents_of_a_run_are_the_best_of_one_region() -> None:
    """With one region of food, lexicase selects an agent with the most items."""
    run = simulate(make_small_experiment("evo", evolution={"selection": "lexicase"}), seed=3)
    for generation in (1, 2):
        eaten = run.food_eaten.values[generation - 1]
        assert (eaten[run.parents.values[generation]] == eaten.max()).all()


def test_a_model_without_cases_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(SlopeClimbers, "records", {})
    with pytest.raises(ExperimentError, match="'lexicase' needs cases, and the model"):
        load("slope-climbers").replace(evolution={"selection": "lexicase"})


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
