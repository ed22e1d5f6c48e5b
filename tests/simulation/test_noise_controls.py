"""Noise controls against changes that are computed agent by agent from the learners."""

from __future__ import annotations

import numpy as np
import pytest

from baldwinlab.evolution import make_founders, make_run_keys
from baldwinlab.experiment import Experiment
from baldwinlab.models import make_simulator
from baldwinlab.models.kit import read_bits
from baldwinlab.models.nk_climbers import landscape
from baldwinlab.papers import presets
from baldwinlab.simulation.generations import SimulatedGeneration, iterate_generations
from baldwinlab.simulation.noise_controls import Kind, NoiseControl

CLIMBERS = presets.load("mayley-1996:costly-climbing/rugged").replace(
    population={"size": 8}, evolution={"generations": 4}, nk_climbers={"bits": 10, "k": 3}
)
READERS = presets.load("keesing-stork-1991:trials-5").replace(
    population={"size": 4}, evolution={"generations": 2}
)
SEED = 5
RUNS = (2, 7)


def list_learners(experiment: Experiment) -> list[SimulatedGeneration]:
    founders = make_founders(experiment, make_run_keys(SEED, RUNS, 0))
    generations = range(experiment.evolution.generations)
    return [*iterate_generations(experiment, SEED, RUNS, generations, founders)]


def evolve(experiment: Experiment, kind: Kind) -> list[SimulatedGeneration]:
    founders = make_founders(experiment, make_run_keys(SEED, RUNS, 0))
    generations = range(experiment.evolution.generations)
    control = NoiseControl(experiment, SEED, RUNS, kind)
    return [*iterate_generations(experiment, SEED, RUNS, generations, founders, control)]


def flip_as_learner(control: SimulatedGeneration, learners: SimulatedGeneration) -> np.ndarray:
    """Return the strings of the yoked control at death, agent by agent."""
    n_agents = control.fitness.shape[1]
    strings = np.empty(control.fitness.shape, np.int64)
    for run in range(len(RUNS)):
        for agent in range(n_agents):
            master = (agent + 1) % n_agents
            death = learners.results.learned
            assert death is not None
            birth_of_master = read_bits(learners.genomes[run, master])
            flips = birth_of_master ^ read_bits(death[run, master][None])
            strings[run, agent] = read_bits(control.genomes[run, agent]) ^ flips
    return strings


def test_yoked_strings_flip_the_bits_of_the_next_learner_and_pay_its_cost() -> None:
    for control, learners in zip(evolve(CLIMBERS, "yoked"), list_learners(CLIMBERS), strict=True):
        strings = flip_as_learner(control, learners)
        cost = np.roll(learners.results.cost, -1, axis=1)
        for row, run in enumerate(RUNS):
            fitness = landscape(SEED, run, 10, 3)[strings[row]] - cost[row]
            assert np.allclose(control.fitness[row], np.maximum(fitness, 0))


def test_drift_flips_as_many_bits_as_the_learner_of_the_same_index() -> None:
    """The string at death is not stored, so that its fitness and all distances are compared."""
    n_changed = 0
    for control, learners in zip(evolve(CLIMBERS, "drift"), list_learners(CLIMBERS), strict=True):
        distances = learners.results.records["changed"]
        energy = control.results.energy
        for row, run in enumerate(RUNS):
            table = landscape(SEED, run, 10, 3)
            for agent, birth in enumerate(read_bits(control.genomes[row])):
                (string,) = np.flatnonzero(table == energy[row, agent])
                assert bin(string ^ int(birth)).count("1") == distances[row, agent]
        n_changed += int(distances.sum())
    assert n_changed > 0


def test_drift_moves_each_weight_as_far_as_that_of_a_learner() -> None:
    founders = make_founders(READERS, make_run_keys(SEED, RUNS, 0))
    control = NoiseControl(READERS, SEED, RUNS, "drift")
    learned = make_simulator(READERS, SEED, RUNS).simulate(0, founders).learned
    assert learned is not None
    # Without trials, the weights at death are those at birth, with the changes of the control.
    changed = control.simulate(0, founders).learned
    assert changed is not None
    expected, moved = learned - founders[:, :, 0], changed - founders[:, :, 0]
    assert np.allclose(np.abs(moved), np.abs(expected), atol=1e-5)
    is_moved = np.abs(expected) > 1e-3
    is_same = np.sign(moved)[is_moved] == np.sign(expected)[is_moved]
    assert 0.4 < is_same.mean() < 0.6


def test_offspring_inherit_strings_at_birth() -> None:
    first, second, *_ = evolve(CLIMBERS.replace(evolution={"mutation_rate": 0.0}), "drift")
    # Founders of a run are equal, and without mutation all offspring equal them.
    assert np.array_equal(second.genomes, first.genomes)


def test_a_generation_out_of_order_is_refused() -> None:
    control = NoiseControl(CLIMBERS, SEED, RUNS, "drift")
    founders = make_founders(CLIMBERS, make_run_keys(SEED, RUNS, 0))
    with pytest.raises(ValueError, match="generation = 2 must be the next one, 0"):
        control.simulate(2, founders)


def test_a_model_without_weights_at_death_is_refused() -> None:
    norms = presets.load("lande-2009:plastic-norms")
    control = NoiseControl(norms, SEED, RUNS, "yoked")
    founders = make_founders(norms, make_run_keys(SEED, RUNS, 0))
    with pytest.raises(ValueError, match="returns no weights at death"):
        control.simulate(0, founders)
