"""The selections by the order of fitness agree with theory."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chisquare

from baldwinlab.experiment import ExperimentError
from baldwinlab.papers.presets import load
from baldwinlab.parts.breeding import ITSELF
from baldwinlab.simulation.simulate import simulate
from tests.evolution.draws import (
    ERROR_RATE,
    FITNESS,
    draw_generations,
    draw_parents,
    require_frequencies,
    use_selection,
)

BEST_FIRST = np.argsort(-FITNESS)


@pytest.mark.parametrize(("share", "mu"), [(0.01, 1), (0.125, 1), (0.25, 2), (0.5, 4), (0.99, 7)])
def test_the_mu_fittest_agents_survive_and_are_the_only_parents(share: float, mu: int) -> None:
    parents = draw_parents(use_selection("mu-plus-lambda", {"survivor_share": share}), FITNESS)
    assert parents[:mu].tolist() == [[agent, ITSELF] for agent in BEST_FIRST[:mu]]
    assert (parents[mu:] >= 0).all()
    assert np.isin(parents[mu:], BEST_FIRST[:mu]).all()


def test_each_survivor_is_a_parent_with_the_probability_1_over_mu() -> None:
    experiment = use_selection("mu-plus-lambda", {"survivor_share": 0.5})
    draws = draw_generations(experiment, FITNESS, 500)[:, 4:]
    survives = np.isin(np.arange(FITNESS.size), BEST_FIRST[:4])
    require_frequencies(np.bincount(draws.ravel(), minlength=FITNESS.size), survives)


def test_survivors_of_an_elite_are_survivors_of_mu_plus_lambda() -> None:
    """Both break ties by the same numbers, so no agent survives twice."""
    experiments = [
        use_selection("mu-plus-lambda", {"survivor_share": 0.5}, elite=elite) for elite in (0, 1)
    ]
    expected, with_elite = (
        draw_generations(experiment, [1.0, 1.0, 1.0, 0.0], 19) for experiment in experiments
    )
    assert with_elite.tolist() == expected.tolist()


def test_the_best_fitness_never_falls_if_it_is_deterministic() -> None:
    """A bit string without learning has the same fitness in each generation."""
    experiment = load("nk-climbers").replace(
        nk_climbers={"trials": 0, "k": 4},
        population={"size": 16},
        evolution={
            "selection": "mu-plus-lambda",
            "variation": "bit-flips",
            "generations": 12,
            "elite": 0,
        },
    )
    best = simulate(experiment, seed=2).energy.max("agent").values
    assert (np.diff(best) >= 0).all()
    assert best[-1] > best[0]


def test_a_share_of_1_is_refused() -> None:
    with pytest.raises(ExperimentError, match="survivor_share = 1"):
        use_selection("mu-plus-lambda", {"survivor_share": 1})


@pytest.mark.parametrize(
    ("share", "children"),
    [(1e-9, [8]), (0.2, [4, 4]), (0.375, [3, 3, 2]), (0.625, [2, 2, 2, 1, 1]), (1.0, [1] * 8)],
)
def test_the_fittest_parents_have_the_remaining_children(share: float, children: list[int]) -> None:
    parents = draw_parents(use_selection("best-copies", {"parent_share": share}), FITNESS)
    counts = np.bincount(parents[:, 0], minlength=FITNESS.size)
    assert counts[BEST_FIRST].tolist() == children + [0] * (FITNESS.size - len(children))


def test_a_share_of_the_children_has_a_random_second_parent_among_the_best() -> None:
    """The best 200 of 1000 agents have five children each."""
    fitness = np.random.default_rng(1).permutation(1000).astype(float)
    single_parent, two_parents = (
        draw_parents(
            use_selection("best-copies", {"parent_share": 0.2, "two_parent_share": share}), fitness
        )
        for share in (0.0, 0.5)
    )
    # Either parent can be the fitter one, which is recorded first.
    second = two_parents.sum(axis=1) - single_parent[:, 0]
    pairs = np.stack([single_parent[:, 0], second], axis=1)
    assert (np.sort(two_parents, axis=1) == np.sort(pairs, axis=1)).all()
    has_two = two_parents[:, 0] != two_parents[:, 1]
    assert abs(has_two.mean() - 0.5 * 199 / 200) < 4 * np.sqrt(0.25 / 1000)
    assert (fitness[two_parents] >= 800).all(), "all parents are among the best 200"
    counts = np.histogram(fitness[second[has_two]], bins=4, range=(800, 1000))[0]
    assert chisquare(counts).pvalue > ERROR_RATE


def test_agents_of_equal_fitness_are_among_the_best_with_equal_probability() -> None:
    parents = draw_generations(use_selection("best-copies"), np.ones(10), 300)
    best = [np.unique(drawn) for drawn in parents]
    assert {agents.size for agents in best} == {2}
    require_frequencies(np.bincount(np.concatenate(best), minlength=10), np.ones(10))
