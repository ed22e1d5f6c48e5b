"""Agents are spread over worlds, and have several lifetimes, without an effect on each other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from baldwinlab.core.errors import ArgumentError
from baldwinlab.evolution import GenerationKey, mean_fitness
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.lifetimes import MiniWorldSimulator
from baldwinlab.models.miniworld.world_layout import draw_world_keys
from baldwinlab.parts.lifetimes import make_lifetimes
from baldwinlab.parts.model_part import LifeResults
from baldwinlab.simulation.replay import replay
from baldwinlab.simulation.simulate import simulate, simulate_batch
from tests.evolution.single_runs import draw_genomes, fitness, lifetimes_of_run
from tests.small_studies import shorten_preset

SEED = 3
N_AGENTS = 6


def small_experiment(name: str = "evo+self-taught/A", **changes: Any) -> Experiment:
    start = {"start": {"x": 400, "y": 160}}
    experiment = shorten_preset(name).replace(population={"size": N_AGENTS}, world=start)
    return experiment.replace(**changes)


def draw(experiment: Experiment, runs: Sequence[int] = (0,)) -> npt.NDArray[np.float32]:
    return np.stack([draw_genomes(experiment, GenerationKey(SEED, run, 0)) for run in runs])


def simulate_generation(
    experiment: Experiment, genomes: npt.NDArray[np.float32], runs: Sequence[int] = (0,)
) -> LifeResults:
    return MiniWorldSimulator(experiment, SEED, runs).simulate(1, genomes)


def simulate_worlds(
    experiment: Experiment, keys: npt.NDArray[np.uint32], genomes: npt.NDArray[np.float32]
) -> tuple[npt.NDArray[Any], ...]:
    """Simulate each world of a repeat in a batch of its own.

    Return energy, cost and number of eaten items, each [agent].
    """
    genomes_by_world = np.split(genomes, len(keys), axis=1)
    worlds = [
        MiniWorldSimulator(experiment, seed, [run]).simulate(1, genomes_of_world)
        for (seed, run), genomes_of_world in zip(keys.tolist(), genomes_by_world, strict=True)
    ]
    return (
        np.concatenate([world.energy[0] for world in worlds]),
        np.concatenate([world.cost[0] for world in worlds]),
        np.concatenate([world.records["food_eaten"][0] for world in worlds]),
    )


@pytest.mark.parametrize("worlds", [N_AGENTS, 2])
@pytest.mark.parametrize("name", ["evo/A", "evo+self-taught/A"])
def test_agents_of_several_worlds_have_the_results_of_as_many_populations(
    name: str, worlds: int
) -> None:
    size = N_AGENTS // worlds
    separate = small_experiment(name, population={"worlds": worlds})
    single = small_experiment(name, population={"size": size})
    genomes = draw(separate)
    results = simulate_generation(separate, genomes)
    keys = draw_world_keys(SEED, [0], repeats=1, worlds=worlds)[0, 0].tolist()
    for world, (seed, run) in enumerate(keys):
        agents = slice(world * size, (world + 1) * size)
        lifetimes = MiniWorldSimulator(single, seed, [run]).simulate(1, genomes[:, agents])
        assert np.array_equal(lifetimes.energy[0], results.energy[0, agents])
        if results.learned is not None and lifetimes.learned is not None:
            assert np.array_equal(lifetimes.learned[0], results.learned[0, agents])
    assert results.energy.any()


@pytest.mark.parametrize("worlds", [1, 3])
def test_the_results_of_three_lifetimes_are_means_of_separate_lifetimes(worlds: int) -> None:
    costs = {"cost_per_change": 0.5}
    repeated = small_experiment(
        lifetime={"repeats": 3}, population={"worlds": worlds}, learning=costs
    )
    single = small_experiment(population={"size": N_AGENTS // worlds}, learning=costs)
    genomes = draw(repeated)
    results = simulate_generation(repeated, genomes)
    keys = draw_world_keys(SEED, [0], repeats=3, worlds=worlds)[:, 0]
    lifetimes = [simulate_worlds(single, keys_of_repeat, genomes) for keys_of_repeat in keys]
    energies, costs_of_lifetimes, n_eaten = map(np.array, zip(*lifetimes, strict=True))
    assert np.allclose(results.energy[0], energies.mean(axis=0))
    assert np.allclose(results.cost[0], costs_of_lifetimes.mean(axis=0))
    assert np.allclose(results.records["food_eaten"][0], n_eaten.mean(axis=0))
    fitness_of_lifetimes = [
        fitness(single, make_lifetimes(genomes[0], energy, cost))
        for energy, cost in zip(energies, costs_of_lifetimes, strict=True)
    ]
    mean_of_fitness = np.mean(fitness_of_lifetimes, axis=0)
    assert np.array_equal(mean_fitness(repeated, results, genomes)[0], mean_of_fitness)
    # Fitness is at least 0 in each lifetime, so that it differs from the fitness of the means.
    assert (mean_of_fitness > results.energy[0] - results.cost[0]).any()


def test_the_first_lifetime_is_that_of_an_experiment_with_one_lifetime() -> None:
    genomes = draw(small_experiment())
    single = simulate_generation(small_experiment(), genomes)
    repeated = simulate_generation(small_experiment(lifetime={"repeats": 2}), genomes)
    assert np.array_equal(repeated.lifetimes[0].energy, single.energy)
    assert not np.array_equal(repeated.lifetimes[1].energy, single.energy)
    assert repeated.learned is not None
    assert single.learned is not None
    assert np.array_equal(repeated.learned, single.learned)


def test_a_selection_reads_the_items_of_all_lifetimes_and_the_means_of_records() -> None:
    experiment = small_experiment(lifetime={"repeats": 3}, evolution={"fitness": "early-food"})
    genomes = draw(experiment)
    results = simulate_generation(experiment, genomes)
    combined = lifetimes_of_run(experiment, results, 0, genomes[0])
    lifetimes = [
        lifetimes_of_run(experiment, lifetime, 0, genomes[0]) for lifetime in results.lifetimes
    ]
    assert np.array_equal(combined.eaten, sum(lifetime.eaten for lifetime in lifetimes))
    assert np.array_equal(combined.position, lifetimes[0].position)
    for name in ("energy", "cost"):
        values = [getattr(lifetime, name) for lifetime in lifetimes]
        assert np.allclose(getattr(combined, name), np.mean(values, axis=0))
    weighted_energies = [lifetime.records.early_energy for lifetime in lifetimes]
    assert np.ptp(weighted_energies, axis=0).any()
    assert np.allclose(combined.records.early_energy, np.mean(weighted_energies, axis=0))


def test_a_run_with_several_worlds_and_lifetimes_does_not_depend_on_its_batch() -> None:
    experiment = small_experiment(population={"worlds": 2}, lifetime={"repeats": 2})
    batch = simulate_batch(experiment, SEED, [0, 4, 5])
    (single,) = simulate_batch(experiment, SEED, [4])
    assert single.identical(batch[1])


def test_a_record_has_the_mean_number_of_eaten_items_with_a_fraction() -> None:
    run = simulate(small_experiment(lifetime={"repeats": 2}), seed=SEED)
    assert run["food_eaten"].dtype == np.float64
    assert (run["food_eaten"] % 1 == 0.5).any()
    assert "mean over the lifetimes" in run["food_eaten"].attrs["long_name"]


def test_the_worlds_of_a_run_have_different_keys_and_the_first_one_has_the_key_of_the_run() -> None:
    keys = draw_world_keys(SEED, [7, 8], repeats=3, worlds=4)
    assert keys.shape == (3, 2, 4, 2)
    assert keys[0, :, 0].tolist() == [[SEED, 7], [SEED, 8]]
    assert len({tuple(key) for key in keys.reshape(-1, 2).tolist()}) == 3 * 2 * 4
    # A world has the same key with more worlds and more repeats.
    assert np.array_equal(draw_world_keys(SEED, [8], repeats=2, worlds=3)[:, 0], keys[:2, 1, :3])


@pytest.mark.parametrize("world", [0, 2])
def test_a_replay_shows_the_agents_and_the_items_of_one_world(world: int) -> None:
    experiment = small_experiment(population={"worlds": 3})
    run = simulate(experiment, seed=SEED)
    trace = replay(experiment, seed=SEED, generation=2, world=world)
    assert trace["agent"].values.tolist() == [2 * world, 2 * world + 1]
    assert trace.attrs["world"] == world
    eaten = run["food_eaten"].sel(generation=2, agent=trace["agent"])
    assert np.array_equal(trace["eaten"].sum("step"), eaten)
    # An item moves in the step in which an agent of the same world eats it.
    has_moved = (np.diff(trace["item_x"], axis=0) != 0).sum(axis=1)
    assert np.array_equal(has_moved, trace["eaten"].sum("agent").values[:-1])


def test_a_replay_refuses_a_world_that_a_population_does_not_have() -> None:
    with pytest.raises(ArgumentError, match=r"world = 3 must be a whole number from 0 to 2"):
        replay(small_experiment(population={"worlds": 3}), world=3)
