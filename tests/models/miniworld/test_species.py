"""Test species that share a world, against one population and against plain Python."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from baldwinlab.core.errors import RefusedError
from baldwinlab.core.variables import record_variables
from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import Experiment, ExperimentError
from baldwinlab.models.miniworld.backends.choice import Backend
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from baldwinlab.models.miniworld.backends.species import SpeciesBatch
from baldwinlab.models.miniworld.lifetimes import MiniWorldSimulator
from baldwinlab.models.miniworld.species import SpeciesSimulator, split_genomes
from baldwinlab.papers.presets import load
from baldwinlab.parts.model_part import LifeResults
from baldwinlab.simulation.simulate import simulate
from tests.evolution.single_runs import draw_genomes
from tests.worlds import N_PREDATORS, N_PREY, PREY_ENERGY, make_predation

SEED = 3
RUNS = (0, 4)


def split_population(experiment: Experiment, *sizes: int, **changes: Any) -> Experiment:
    """Return an experiment with species of equal settings, except for the changes of the last."""
    species: list[dict[str, Any]] = [
        {"name": f"species-{number}", "size": size} for number, size in enumerate(sizes)
    ]
    species[-1] |= changes
    return experiment.replace(population={"size": sum(sizes), "species": species})


def draw_all_genomes(experiment: Experiment) -> npt.NDArray[np.float32]:
    """Return random genomes [run, agent, module, weight]."""
    return np.stack([draw_genomes(experiment, GenerationKey(SEED, run, 0)) for run in RUNS])


def simulate_species(
    experiment: Experiment, genomes: npt.NDArray[np.float32], *sizes_of_runs: list[int]
) -> LifeResults:
    simulator = SpeciesSimulator(experiment, SEED, RUNS)
    return simulator.simulate(2, genomes, np.array(sizes_of_runs))


# The compilation takes 14 s for each condition.
@pytest.mark.nightly
@pytest.mark.parametrize("condition", ["evo", "evo+self-taught"])
def test_two_equal_species_have_the_results_of_one_population(condition: str) -> None:
    experiment = load(f"{condition}/A").replace(
        lifetime={"steps": 400}, motor={"noise": 0.1}, learning={"cost_per_change": 0.1}
    )
    genomes = draw_all_genomes(experiment)
    expected = MiniWorldSimulator(experiment, SEED, RUNS).simulate(2, genomes)
    assert expected.energy.sum() > 0
    species = split_population(experiment, 12, 8)
    for sizes in ([[12, 8], [12, 8]], [[3, 17], [20, 0]]):
        actual = simulate_species(species, genomes, *sizes)
        np.testing.assert_array_equal(actual.energy, expected.energy)
        np.testing.assert_array_equal(actual.cost, expected.cost)
        np.testing.assert_array_equal(actual.eaten, expected.eaten)
        np.testing.assert_array_equal(actual.position, expected.position)
        np.testing.assert_array_equal(actual.records["food_eaten"], expected.records["food_eaten"])
        if condition != "evo":
            np.testing.assert_array_equal(actual.learned, expected.learned)


def draw_padded_genomes(experiment: Experiment) -> npt.NDArray[np.float32]:
    """Return random genomes [run, agent, module, weight] in the layout of the longest genome."""
    shape = (len(RUNS), N_PREDATORS + N_PREY, len(experiment.modules), experiment.genome_length)
    return np.random.default_rng(SEED).normal(size=shape).astype(np.float32)


def circular_distance(x: Any, y: Any, experiment: Experiment) -> Any:
    """Return the distances on the torus between positions [2] and [2, agent]."""
    sides = (experiment.world.width, experiment.world.height)
    differences = [
        (target - start + side / 2) % side - side / 2
        for start, target, side in zip(x, y, sides, strict=True)
    ]
    return np.hypot(*differences), differences


def naive_sectors(
    position: Any, heading: float, targets: Any, alive: Any, radius: float, experiment: Experiment
) -> list[float]:
    """Return the distance of the nearest target in each sector, infinite without a target."""
    distances, (dx, dy) = circular_distance(position, targets, experiment)
    theta = (np.degrees(np.arctan2(dy, dx)) - heading * 9) % 360
    in_sight = alive & (distances <= radius)
    sectors = [
        (theta > 315) & (theta < 345),
        (theta <= 15) | (theta >= 345),
        (theta > 15) & (theta < 45),
    ]
    return [min(distances[in_sight & sector], default=np.inf) for sector in sectors]


def make_batch(experiment: Experiment) -> SpeciesBatch:
    batch = SpeciesBatch(experiment, SEED, RUNS, [N_PREDATORS, N_PREY])
    batch.begin(2, split_genomes(batch.members, draw_padded_genomes(experiment)))
    return batch


class World:
    """Copies of the agents of one world of a batch, in float64."""

    def __init__(self, batch: SpeciesBatch, world: int) -> None:
        self.predator_lanes = slice(world * N_PREDATORS, (world + 1) * N_PREDATORS)
        self.prey_lanes = slice(world * N_PREY, (world + 1) * N_PREY)
        predators, prey = batch.states
        self.predators = predators.positions[:, self.predator_lanes].astype(float)
        self.prey = prey.positions[:, self.prey_lanes].astype(float)
        self.predator_headings = predators.heading[0, self.predator_lanes].copy()
        self.prey_headings = prey.heading[0, self.prey_lanes].copy()
        self.prey_actions = prey.action[0, self.prey_lanes].copy()
        self.predator_inputs = predators.activations[3:6, self.predator_lanes].copy()
        self.prey_inputs = prey.activations[3:6, self.prey_lanes].copy()
        self.alive = prey.alive[0, self.prey_lanes] > 0
        self.eaten = predators.eaten_in_life[1, self.predator_lanes].copy()


def eat_in_turn(before: World, after: World, step: int, experiment: Experiment) -> tuple[Any, Any]:
    """Return the number of prey that each predator eats in a step, and the living prey."""
    # An eaten agent has left the map, so its last position follows from its move.
    angles = np.radians(9 * after.prey_headings)
    speed = np.where(after.prey_actions == 1, 2, 1)
    moved = before.prey + speed * np.array([np.cos(angles), np.sin(angles)])
    alive = before.alive.copy()
    eaten = np.zeros(N_PREDATORS, int)
    n_agents = N_PREDATORS + N_PREY
    for turn in range(n_agents):
        number = (step + turn) % n_agents
        if number < N_PREDATORS:
            distances, _ = circular_distance(after.predators[:, number], moved, experiment)
            touched = alive & (distances < experiment.contact.reach)
            eaten[number] = touched.sum()
            alive &= ~touched
    return eaten, alive


# The compilation takes 16 s. The example of predators is checked in every test run.
@pytest.mark.nightly
def test_sight_of_other_species_agrees_with_a_naive_model() -> None:
    experiment = make_predation()
    batch = make_batch(experiment)
    n_seen = 0
    for step in range(experiment.lifetime.steps):
        before = World(batch, 1)
        batch.simulate(step, step + 1)
        after = World(batch, 1)
        for number in range(N_PREDATORS):
            position = before.predators[:, number]
            heading = before.predator_headings[number]
            distances = naive_sectors(position, heading, before.prey, before.alive, 30, experiment)
            expected = [0 if np.isinf(distance) else 1 - distance / 30 for distance in distances]
            np.testing.assert_allclose(after.predator_inputs[:, number], expected, atol=1e-4)
            n_seen += int(sum(expected) > 0)
        all_alive = np.ones(N_PREDATORS, bool)
        for number in np.flatnonzero(before.alive).tolist():
            position = before.prey[:, number]
            heading = before.prey_headings[number]
            distances = naive_sectors(
                position, heading, before.predators, all_alive, 40, experiment
            )
            expected = [float(np.isfinite(distance)) for distance in distances]
            np.testing.assert_array_equal(after.prey_inputs[:, number], expected)
    assert n_seen > 10


def test_predation_agrees_with_a_naive_model() -> None:
    experiment = make_predation()
    batch = make_batch(experiment)
    for step in range(experiment.lifetime.steps):
        before = World(batch, 1)
        batch.simulate(step, step + 1)
        after = World(batch, 1)
        eaten, alive = eat_in_turn(before, after, step, experiment)
        np.testing.assert_array_equal(after.eaten - before.eaten, eaten)
        np.testing.assert_array_equal(after.alive, alive)
    assert after.eaten.sum() > 3
    predators, prey = batch.states
    assert (predators.eaten_in_life[0] == 0).all()
    assert prey.eaten_in_life[:, : len(RUNS) * N_PREY].sum() > 0


def test_results_contain_the_records_of_all_species() -> None:
    experiment = make_predation()
    genomes = draw_padded_genomes(experiment)
    results = simulate_species(experiment, genomes, *[[N_PREDATORS, N_PREY]] * 2)
    predators = slice(N_PREDATORS)
    prey = slice(N_PREDATORS, None)
    dead = 1 - results.records["alive"][:, prey]
    np.testing.assert_array_equal(
        results.records["prey_eaten"][:, predators].sum(axis=1), dead.sum(axis=1)
    )
    np.testing.assert_array_equal(
        results.energy[:, predators], PREY_ENERGY * results.records["prey_eaten"][:, predators]
    )
    np.testing.assert_array_equal(results.energy[:, prey], results.records["food_eaten"][:, prey])
    assert (results.records["food_eaten"][:, predators] == 0).all()
    assert (results.records["prey_eaten"][:, prey] == 0).all()
    assert (results.records["age"][:, prey][dead == 1] <= experiment.lifetime.steps).all()
    assert set(results.records) | {"species"} <= set(record_variables(experiment)) | {"born"}


@pytest.mark.nightly
def test_predators_that_eat_nothing_do_not_change_the_results_of_prey() -> None:
    experiment = make_predation()
    species = [entry.model_dump(mode="json") for entry in experiment.population.species]
    species[0]["eats"] = {"items": []}
    species[1]["senses"] = {"kinds": ["food"]}
    harmless = experiment.replace(population={"species": species})
    genomes = draw_padded_genomes(experiment)
    opposite_predators = genomes.copy()
    opposite_predators[:, :N_PREDATORS] *= -1
    sizes = [[N_PREDATORS, N_PREY]] * len(RUNS)
    expected = simulate_species(harmless, genomes, *sizes)
    actual = simulate_species(harmless, opposite_predators, *sizes)
    assert (expected.energy[:, :N_PREDATORS] == 0).all()
    assert expected.energy.sum() > 0
    np.testing.assert_array_equal(actual.energy, expected.energy)


def test_a_run_with_predators_and_prey_evolves() -> None:
    run = simulate(make_predation(evolution={"generations": 3}), seed=1)
    assert run["prey_eaten"].sum() > 0
    assert run.sizes["generation"] == 3


def make_food_species() -> Experiment:
    """Return an experiment with a species that has the name of a kind of items, and is prey."""
    eats = {"prey": [{"species": "food"}]}
    species = [{"name": "food", "size": 10}, {"name": "predators", "size": 10, "eats": eats}]
    return load("evo/A").replace(population={"species": species})


def split_in_half(**settings: Any) -> Experiment:
    return split_population(load("evo/A"), 10, 10, **settings)


IN_SIGHT = {"kinds": ["species-in-sight"], "species_in_sight": {"target": "plants"}}


@pytest.mark.parametrize(
    ("make", "changes", "message"),
    [
        (make_predation, {"lifetime": {"update": "sequential"}}, "share the simultaneous update"),
        (make_predation, {"eats": {"items": ["gold"]}}, "must be among the kinds of items: food"),
        (
            split_in_half,
            {"eats": {"prey": [{"species": "plants"}]}},
            r"eats.prey.0.species = 'plants': must be",
        ),
        (
            split_in_half,
            {"senses": IN_SIGHT},
            r"senses.species_in_sight.target = 'plants': must be one of",
        ),
        (make_food_species, {}, "rename the species"),
    ],
)
def test_settings_that_do_not_fit_the_species_are_refused(
    make: Callable[..., Experiment], changes: dict[str, Any], message: str
) -> None:
    with pytest.raises(ExperimentError, match=message):
        make(**changes)


def test_a_batch_of_one_species_refuses_an_experiment_with_several() -> None:
    with pytest.raises(RefusedError, match="a batch of one species needs"):
        CpuBatch(make_predation(), SEED, RUNS)


def test_species_run_on_the_cpu_only() -> None:
    backend = Backend(name="cuda", batch=CpuBatch, worlds=1)
    with pytest.raises(ValueError, match="runs on the CPU only"):
        SpeciesSimulator(make_predation(), SEED, RUNS, backend)
