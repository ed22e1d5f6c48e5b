"""The selection schemes by rank agree with theory."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.stats import chisquare

from baldwinlab.engine import rng
from baldwinlab.evolution import GenerationKey, Parents, select
from baldwinlab.experiment import ExperimentError
from baldwinlab.papers.presets import load
from baldwinlab.parts.breeding import ITSELF
from baldwinlab.simulation.simulate import simulate

FITNESS = np.array([3.0, 0.0, 5.0, 1.0, 0.5, 7.5, 2.0, 4.0])


def draw_parents(
    selection: str, fitness: npt.NDArray[np.float64], generation: int = 1, **evolution: Any
) -> Parents:
    return select(
        load("evo/A").replace(evolution={"selection": selection, **evolution}),
        fitness,
        GenerationKey(3, 0, generation).uniforms(rng.SELECTION, (fitness.size, 2)),
    )


def test_the_probability_of_a_rank_is_the_rank_divided_by_the_sum_of_ranks() -> None:
    # The two agents with the fitness 1 share the mean of ranks 2 and 3.
    fitness = np.array([1.0, 0.0, 1.0, 9.0])
    draws = np.concatenate(
        [draw_parents("rank", fitness, generation).ravel() for generation in range(1, 500)]
    )
    expected = np.array([2.5, 1.0, 2.5, 4.0]) / 10 * draws.size
    assert chisquare(np.bincount(draws, minlength=4), expected).pvalue > 0.001


@pytest.mark.parametrize(("share", "mu"), [(0.01, 1), (0.125, 1), (0.25, 2), (0.5, 4), (0.99, 7)])
def test_the_mu_fittest_agents_survive_and_are_the_only_parents(share: float, mu: int) -> None:
    best = np.argsort(-FITNESS)[:mu]
    parents = draw_parents("mu-plus-lambda", FITNESS, mu_plus_lambda={"survivor_share": share})
    assert parents[:mu].tolist() == [[agent, ITSELF] for agent in best]
    assert (parents[mu:] >= 0).all()
    assert np.isin(parents[mu:], best).all()


def test_each_survivor_is_a_parent_with_the_probability_1_over_mu() -> None:
    settings = {"mu_plus_lambda": {"survivor_share": 0.5}}
    draws = np.concatenate(
        [
            draw_parents("mu-plus-lambda", FITNESS, generation, **settings)[4:].ravel()
            for generation in range(1, 500)
        ]
    )
    counts = np.bincount(draws, minlength=FITNESS.size)
    assert (counts[np.argsort(-FITNESS)[4:]] == 0).all()
    assert chisquare(counts[counts > 0]).pvalue > 0.001


def test_survivors_of_an_elite_are_survivors_of_mu_plus_lambda() -> None:
    """Both break ties by the same numbers, so no agent survives twice."""
    fitness = np.array([1.0, 1.0, 1.0, 0.0])
    settings = {"mu_plus_lambda": {"survivor_share": 0.5}}
    for generation in range(1, 20):
        expected = draw_parents("mu-plus-lambda", fitness, generation, **settings)
        with_elite = draw_parents("mu-plus-lambda", fitness, generation, elite=1, **settings)
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
        draw_parents("mu-plus-lambda", FITNESS, mu_plus_lambda={"survivor_share": 1})
