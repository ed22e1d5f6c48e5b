"""The selections with a probability proportional to fitness agree with theory."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.stats import chisquare

from tests.evolution.draws import (
    ERROR_RATE,
    FITNESS,
    count_parents,
    draw_generations,
    draw_parents,
    require_frequencies,
    use_selection,
)

EXPECTED_OFFSPRING = use_selection("expected-offspring")
OUTCROSSING = use_selection("outcrossing")


@pytest.mark.parametrize(
    ("fitness", "expected"),
    [
        (FITNESS, 2 * FITNESS.size * FITNESS / FITNESS.sum()),
        ([4.0, 1.0, 3.0, 0.0], [4, 1, 3, 0]),
        ([0.3] * 6, [2] * 6),
        # If all fitness values are 0, each agent has the same number of children.
        ([0.0] * 6, [2] * 6),
    ],
)
def test_the_expected_number_of_children_is_rounded_down_or_up(fitness: Any, expected: Any) -> None:
    counts = count_parents(EXPECTED_OFFSPRING, fitness, 300)
    assert (counts >= np.floor(expected)).all()
    assert (counts <= np.ceil(expected)).all()
    assert (counts.sum(axis=1) == 2 * len(fitness)).all()


def test_expected_offspring_has_the_mean_of_roulette_and_the_minimum_variance() -> None:
    slots = 2 * FITNESS.size
    rounds = 1000
    expected = slots * FITNESS / FITNESS.sum()
    binomial = expected * (1 - expected / slots)
    minimum = (expected % 1) * (1 - expected % 1)
    for scheme, variance in (("roulette", binomial), ("expected-offspring", minimum)):
        counts = count_parents(use_selection(scheme), FITNESS, rounds)
        assert (np.abs(counts.mean(axis=0) - expected) <= 4.5 * np.sqrt(variance / rounds)).all()
        assert (np.abs(counts.var(axis=0) - variance) <= 0.25 * variance + 1e-12).all()


def test_expected_offspring_pairs_parents_at_random() -> None:
    """Each of 6 agents is a parent twice.

    For each parent, one of the 11 remaining slots holds the same agent.
    """
    pairs = draw_generations(EXPECTED_OFFSPRING, np.ones(6), 600)
    selfed = pairs[..., 0] == pairs[..., 1]
    assert abs(selfed.mean() - 1 / 11) < 4 * np.sqrt(1 / 11 * 10 / 11 / selfed.size)
    first = pairs[:, 0, 0]
    assert chisquare(np.bincount(first, minlength=6)).pvalue > ERROR_RATE


def test_outcrossing_draws_the_second_parent_by_fitness_from_the_remaining_agents() -> None:
    """The first parent is drawn by roulette, the second by roulette without the first."""
    pairs = draw_generations(OUTCROSSING, FITNESS, 1000).reshape(-1, 2)
    share = FITNESS / FITNESS.sum()
    # No agent mates with itself.
    ordered = np.outer(share, share) / (1 - share)[:, None] * (1 - np.eye(FITNESS.size))
    actual = np.zeros_like(ordered)
    np.add.at(actual, (pairs.min(axis=1), pairs.max(axis=1)), 1)
    require_frequencies(actual, np.triu(ordered + ordered.T))


@pytest.mark.parametrize("fit_agent", range(4))
def test_a_single_agent_with_fitness_mates_with_any_second_agent(fit_agent: int) -> None:
    fitness = np.where(np.arange(4) == fit_agent, 2.0, 0.0)
    pairs = draw_generations(OUTCROSSING, fitness, 99).reshape(-1, 2)
    assert (pairs[:, 0] == fit_agent).all()
    assert set(pairs[:, 1].tolist()) == set(range(4)) - {fit_agent}
    # In a population of one agent, the agent is both parents.
    assert (draw_parents(OUTCROSSING, fitness[:1]) == 0).all()
