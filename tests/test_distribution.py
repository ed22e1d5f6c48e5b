"""Whole runs of the engine against whole runs of the oracle: different random numbers, the same distribution."""

from __future__ import annotations

from random import Random

import numpy as np
import pytest
from scipy.stats import mannwhitneyu

from baldwinlab.experiment import Experiment
from baldwinlab.simulation.simulate import simulate_batch
from tests import naive
from tests.worlds import make_small_experiment

NAIVE_RUNS, ENGINE_RUNS = 20, 300


def experiment(condition: str, update: str) -> Experiment:
    evolution = {"generations": 4, "mutation_rate": 0.2, "mutation_size": 1.0}
    return make_small_experiment(
        condition,
        lifetime={"steps": 150, "update": update},
        learning={"rate": 0.2},
        evolution=evolution,
    )


@pytest.mark.nightly  # half a minute for each, and a life of the engine is held against the oracle step by step elsewhere
@pytest.mark.parametrize(
    ("condition", "update"),
    [
        ("evo", "simultaneous"),
        ("evo+self-taught", "simultaneous"),
        ("evo+self-taught", "sequential"),
        ("self-taught", "simultaneous"),
    ],
)
def test_engine_and_oracle_eat_as_much(condition: str, update: str) -> None:
    tested = experiment(condition, update)
    ours = np.array(
        [result["food_eaten"].values for result in simulate_batch(tested, 1, range(ENGINE_RUNS))]
    )
    theirs = np.array(
        [
            [[agent.eaten for agent in agents] for agents in naive.evolve(tested, Random(seed))]
            for seed in range(NAIVE_RUNS)
        ]
    )
    assert theirs[:, 0].sum() > 100, "too little is eaten to tell"
    for statistic in (np.sum, np.max, np.min):
        for generation in range(tested.evolution.generations):
            eaten = [statistic(runs[:, generation], axis=-1) for runs in (ours, theirs)]
            assert mannwhitneyu(*eaten).pvalue > 0.001, (statistic.__name__, generation)
