"""The selection schemes by rank agree with theory."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.stats import chisquare

from baldwinlab.engine import rng
from baldwinlab.evolution import GenerationKey, Parents, select
from baldwinlab.experiment import Experiment, ExperimentError
from baldwinlab.papers.presets import load
from baldwinlab.parts.breeding import ITSELF
from baldwinlab.simulation.simulate import simulate

FITNESS = np.array([3.0, 0.0, 5.0, 1.0, 0.5, 7.5, 2.0, 4.0])


def use_survivors(survivor_share: float, **evolution: Any) -> Experiment:
    """Return an experiment with the selection mu-plus-lambda."""
    fields = {"selection": "mu-plus-lambda", "mu_plus_lambda": {"survivor_share": survivor_share}}
    experiment: Experiment = load("evo/A").replace(evolution=fields | evolution)
    return experiment


def draw_parents(
    experiment: Experiment, fitness: npt.NDArray[np.float64], generation: int = 1
) -> Parents:
    return select(
        experiment,
        fitness,
        GenerationKey(3, 0, generation).uniforms(rng.SELECTION, (fitness.size, 2)),
    )


@pytest.mark.parametrize(("share", "mu"), [(0.01, 1), (0.125, 1), (0.25, 2), (0.5, 4), (0.99, 7)])
def test_the_mu_fittest_agents_survive_and_are_the_only_parents(share: float, mu: int) -> None:
    best = np.argsort(-FITNESS)[:mu]
    parents = draw_parents(use_survivors(share), FITNESS)
    assert parents[:mu].tolist() == [[agent, ITSELF] for agent in best]
    assert (parents[mu:] >= 0).all()
    assert np.isin(parents[mu:], best).all()


def test_each_survivor_is_a_parent_with_the_probability_1_over_mu() -> None:
    experiment = use_survivors(0.5)
    draws = np.concatenate(
        [draw_parents(experiment, FITNESS, generation)[4:].ravel() for generation in range(1, 500)]
    )
    counts = np.bincount(draws, minlength=FITNESS.size)
    assert (counts[np.argsort(-FITNESS)[4:]] == 0).all()
    assert chisquare(counts[counts > 0]).pvalue > 0.001


def test_survivors_of_an_elite_are_survivors_of_mu_plus_lambda() -> None:
    """Both break ties by the same numbers, so no agent survives twice."""
    fitness = np.array([1.0, 1.0, 1.0, 0.0])
    for generation in range(1, 20):
        expected = draw_parents(use_survivors(0.5), fitness, generation)
        with_elite = draw_parents(use_survivors(0.5, elite=1), fitness, generation)
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
        use_survivors(1)
