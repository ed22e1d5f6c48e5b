"""Walks against plain Python and the exact expected time."""

from __future__ import annotations

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.analysis.theory.adaptive_walk import compute_fixation_probabilities
from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import assign
from baldwinlab.models.lattice_walkers import (
    LatticeWalkers,
    average_neighborhood,
    climb,
    fixation_probability,
    make_landscape,
)
from baldwinlab.simulation.simulate import simulate_histories
from tests.evolution.single_runs import breed
from tests.oracles.theory.adaptive_walk import compute_step_probabilities, expect_walk_time


def climb_in_python(fitness: list[float], position: int, steps: int) -> int:
    for _ in range(steps):
        neighbors = [q for q in (position + 1, position - 1) if 0 <= q < len(fitness)]
        best = max(neighbors, key=lambda q: fitness[q])
        if fitness[best] <= fitness[position]:
            break
        position = best
    return position


@pytest.mark.parametrize("steps", [0, 1, 2, 5])
def test_agents_climb_to_the_fitter_neighbor(steps: int) -> None:
    for run in range(20):
        fitness = make_landscape(3, run, 12, 0.05, 0.5)
        expected = [climb_in_python(fitness.tolist(), position, steps) for position in range(12)]
        assert climb(fitness, steps).tolist() == expected


def test_random_plasticity_has_the_mean_fitness_of_the_neighborhood() -> None:
    fitness = np.array([1.0, 2.0, 6.0, 3.0])
    assert average_neighborhood(fitness, 0).tolist() == fitness.tolist()
    assert average_neighborhood(fitness, 1) == pytest.approx([4 / 3, 3, 11 / 3, 4])
    assert average_neighborhood(fitness, 2) == pytest.approx([11 / 5, 13 / 5, 3, 17 / 5])


def test_without_roughness_fitness_rises_by_the_slope() -> None:
    assert make_landscape(3, 0, 8, 0.15, 0.0) == pytest.approx(1.15 ** np.arange(8))


def test_a_landscape_depends_on_the_run_and_has_the_declared_changes() -> None:
    landscapes = np.array([make_landscape(3, run, 200, 0.15, 0.4) for run in range(20)])
    changes = landscapes[:, 1:] / landscapes[:, :-1] - 1
    assert changes.min() > -0.25 and changes.max() < 0.55
    assert changes.mean() == pytest.approx(0.15, abs=4 * 0.4 / np.sqrt(3 * changes.size))
    assert len(np.unique(landscapes[:, 1])) == 20


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


@pytest.mark.parametrize("members", [1, 2, 10])
def test_the_compiled_probability_agrees_with_theory(members: int) -> None:
    generator = np.random.default_rng(members)
    mutant, resident = generator.uniform(0, 3, (2, 50))
    mutant[0] = 0
    expected = compute_fixation_probabilities(mutant, resident, members)
    result = [fixation_probability(*pair, members) for pair in zip(mutant, resident, strict=True)]
    assert result == pytest.approx(expected.tolist(), rel=1e-13)


@pytest.mark.parametrize("mutant_fitness", [0.0, 0.9, 1.0, 1.3])
def test_mutants_replace_their_population_as_often_as_expected(mutant_fitness: float) -> None:
    pairs = 20_000
    experiment = assign(bl.load("fixed-walk/slope"), [f"population.size={2 * pairs}"])
    # The populations are at position 0, and their mutants at position 5.
    genomes = np.tile(np.array([0, 5], np.float32), pairs)[:, None, None]
    fitness = np.tile([1.0, mutant_fitness], pairs)
    children, parents = breed(experiment, genomes, fitness, GenerationKey(1, 0, 1))
    populations, mutants = children[::2, 0, 0], children[1::2, 0, 0]
    assert set(np.unique(populations)) <= {0, 5}
    # Each pair is separate, and a mutant is one step from its population.
    assert (parents // 2 == np.arange(2 * pairs)[:, None] // 2).all()
    assert (np.abs(mutants - populations) == 1).all()
    probability = float(compute_fixation_probabilities(np.array(mutant_fitness), np.array(1.0), 10))
    error = np.sqrt(probability * (1 - probability) / pairs)
    assert abs((populations == 5).mean() - probability) <= 4 * error
    assert abs((mutants > populations).mean() - 0.5) < 4 * 0.5 / np.sqrt(pairs)
