"""Test that runs of the engine and of the naive implementation have the same distribution."""

from __future__ import annotations

from random import Random

import numpy as np
import pytest
from scipy.stats import mannwhitneyu

from baldwinlab.experiment import Experiment
from baldwinlab.simulation.simulate import simulate_batch
from tests import naive
from tests.worlds import make_small_experiment

NAIVE_RUNS = 20
ENGINE_RUNS = 300


def make_experiment(condition: str, update: str) -> Experiment:
    evolution = {"generations": 4, "mutation_rate": 0.2, "mutation_size": 1.0}
    return make_small_experiment(
        condition,
        lifetime={"steps": 150, "update": update},
        learning={"rate": 0.2},
        evolution=evolution,
    )


def eaten_by_generation(experiment: Experiment, seed: int) -> list[list[int]]:
    """Return the number of eaten items [generation, agent] of a naive run."""
    history = naive.evolve(experiment, Random(seed))
    return [[agent.eaten for agent in agents] for agents in history]


# Each case takes half a minute. `test_transitions.py` compares single lifetimes step by step.
@pytest.mark.nightly
@pytest.mark.parametrize(
    ("condition", "update"),
    [
        ("evo", "simultaneous"),
        ("evo+self-taught", "simultaneous"),
        ("evo+self-taught", "sequential"),
        ("self-taught", "simultaneous"),
    ],
)
def test_agents_of_engine_and_naive_runs_eat_the_same_amount(condition: str, update: str) -> None:
    experiment = make_experiment(condition, update)
    results = simulate_batch(experiment, 1, range(ENGINE_RUNS))
    engine = np.array([result["food_eaten"].values for result in results])
    plain = np.array([eaten_by_generation(experiment, seed) for seed in range(NAIVE_RUNS)])
    assert plain[:, 0].sum() > 100, "the agents eat too little for a comparison"
    for statistic in (np.sum, np.max, np.min):
        for generation in range(experiment.evolution.generations):
            eaten = [statistic(runs[:, generation], axis=-1) for runs in (engine, plain)]
            assert mannwhitneyu(*eaten).pvalue > 0.001, (statistic.__name__, generation)
