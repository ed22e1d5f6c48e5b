"""Reevaluation of stored genomes in the stored world gives the stored results."""

from __future__ import annotations

import numpy as np
import pytest

from baldwinlab.experiment import Experiment
from baldwinlab.simulation.reevaluation import iterate_genomes, reevaluate, restore_genomes
from baldwinlab.simulation.replay import replay
from baldwinlab.simulation.simulate import simulate
from tests.worlds import make_small_experiment

COSTS = {"cost_per_step": 0.001, "cost_per_change": 0.1}


@pytest.mark.parametrize(
    "experiment",
    [
        make_small_experiment("evo"),
        make_small_experiment("evo+self-taught"),
        make_small_experiment("evo+self-taught", lifetime={"update": "sequential"}),
        make_small_experiment(
            "evo+self-taught", learning={**COSTS, "evolved_rate": True, "rate": 0.5}
        ),
        make_small_experiment("self-taught", population={"size": 1}),
    ],
)
def test_reevaluation_of_a_generation_gives_the_stored_results(experiment: Experiment) -> None:
    runs = (4, 0, 9)
    records = [simulate(experiment, seed=2, run=run) for run in runs]
    for generation in range(3):
        genomes = np.stack([record.genome.values[generation] for record in records])
        lives = reevaluate(experiment, 2, runs, generation, genomes)
        assert np.array_equal(lives.energy, [record.energy[generation] for record in records])
        trace = replay(experiment, seed=2, generation=generation, run=9)
        assert np.array_equal(lives.weights[2], trace.weight_death[:, 0, : experiment.weight_count])
    assert sum(record.food_eaten.sum() for record in records) > 0


def test_agents_with_a_single_module_use_the_first_module() -> None:
    learner = make_small_experiment("evo+self-taught")
    without = learner.replace(learning={"rule": "none"})
    genomes = simulate(learner, seed=1).genome.values[None, 2]
    lives = reevaluate(without, 1, [0], 2, genomes)
    assert np.array_equal(lives.energy, reevaluate(without, 1, [0], 2, genomes[:, :, :1]).energy)
    assert np.array_equal(lives.weights, genomes[:, :, 0])


@pytest.mark.parametrize("inherited", [0.0, 0.5], ids=["darwinian", "lamarckian"])
def test_genomes_that_were_not_stored_are_recomputed(inherited: float) -> None:
    experiment = make_small_experiment(
        "evo+self-taught", evolution={"generations": 6, "lamarckian_share": inherited}
    )
    every = simulate(experiment, seed=3, run=1)
    some = simulate(experiment.replace(record={"genome_every": 4}), seed=3, run=1)
    for generation in range(6):
        assert np.array_equal(
            restore_genomes(experiment, some, generation), every.genome[generation]
        )
    assert np.array_equal(list(iterate_genomes(experiment, some)), every.genome)
