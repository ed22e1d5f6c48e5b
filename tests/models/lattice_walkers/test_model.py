"""Walks against plain Python and the exact expected time."""

from __future__ import annotations

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.experiment import assign
from baldwinlab.models.lattice_walkers.landscape import average_neighborhood, climb
from baldwinlab.models.lattice_walkers.model import LatticeWalkers
from baldwinlab.simulation.simulate import simulate_histories
from tests.oracles.theory.adaptive_walk import compute_step_probabilities, expect_walk_time

POSITIONS = np.arange(-1, 14, dtype=np.float32)


@pytest.mark.parametrize("steps", [1, 3])
@pytest.mark.parametrize("plasticity", ["none", "climbing", "random"])
def test_a_lifetime_agrees_with_the_landscape_of_the_run(plasticity: str, steps: int) -> None:
    model = LatticeWalkers(plasticity=plasticity, roughness=0.4, learning_steps=steps)
    genomes = np.tile(POSITIONS[:, None, None], (2, 1, 1, 1))
    results = model.simulate(5, [2, 7], 0, genomes)
    assert results.learned is not None
    for row, run in enumerate((2, 7)):
        landscape = model.landscape(5, run)
        learned = climb(landscape, steps) if plasticity == "climbing" else np.arange(13)
        mean = average_neighborhood(landscape, steps)
        for agent, position in enumerate(range(-1, 14)):
            records = {name: values[row, agent] for name, values in results.records.items()}
            assert records["position"] == position
            assert records["at_peak"] == (position == landscape.argmax())
            if 0 <= position < 13:
                fitness = mean[position] if plasticity == "random" else landscape[learned[position]]
                assert results.energy[row, agent] == fitness
                assert records["innate"] == np.float32(landscape[position])
                assert results.learned[row, agent, 0] == learned[position]
                assert records["climbed"] == abs(learned[position] - position)
            else:
                assert results.energy[row, agent] == records["innate"] == records["climbed"] == 0


def test_without_learning_fitness_is_that_of_the_position() -> None:
    model = LatticeWalkers(plasticity="random", roughness=0.4)
    results = model.without_learning().simulate(5, [2], 0, POSITIONS[None, 1:-1, None, None])
    assert (results.energy[0] == model.landscape(5, 2)).all()


@pytest.mark.parametrize("name", ["fixed-walk", "learning-walk", "random-walk"])
def test_the_mean_time_of_simulated_walks_is_the_expected_time(name: str) -> None:
    """200 walks on each of 2 random landscapes of 5 positions. All of them end."""
    experiment = assign(
        bl.load(f"{name}/valleys"),
        [
            "population.size=400",
            "evolution.generations=600",
            "evolution.mutant_fixation.members=5",
            "lattice_walkers.length=5",
        ],
    )
    model = experiment.model_part
    for run, history in enumerate(simulate_histories(experiment, 3, range(2))):
        landscape = model.landscape(3, run)
        steps = compute_step_probabilities(model.plastic_fitness(landscape), 5)
        expected = expect_walk_time(*steps, int(landscape.argmax()))
        at_peak = history.recorded_values("at_peak")[:, ::2] > 0
        assert at_peak.any(axis=0).all()
        times = at_peak.argmax(axis=0)
        assert abs(times.mean() - expected) <= 4 * times.std() / np.sqrt(times.size)
