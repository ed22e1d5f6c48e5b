"""Species evolve separately, or compete in one selection."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.evolution import GenerationKey, Genome
from baldwinlab.evolution.genes import trim_genomes
from baldwinlab.evolution.species import (
    count_agents,
    derive_seed,
    list_initial_species,
)
from baldwinlab.evolution.species_breeding import Offspring, iterate_members
from baldwinlab.evolution.variation_operators import Crossover
from baldwinlab.parts import Mating, compiled, per_run
from baldwinlab.parts.lifetimes import make_lifetimes
from tests.evolution.single_runs import (
    compute_species_fitness,
    fitness,
    inherit_within_species,
    make_founders,
    make_generation,
    make_offspring,
    select_lifetimes,
)

KEY = GenerationKey(seed=3, run=2, generation=0)
CHILD_KEY = KEY._replace(generation=1)
vary_by_crossover = compiled(Crossover.vary)
LEARNERS = {"name": "learners", "size": 8, "learning": {"rule": "self-taught"}}


def make_experiment(**changes: Any) -> Any:
    innate = {"name": "innate", "size": 12} | changes.pop("innate", {})
    learners = LEARNERS | changes.pop("learners", {})
    return bl.load("evo/A").replace(population={"species": [learners, innate]}, **changes)


def breed(experiment: Any, fitness: Any, arrays: Any = None) -> tuple[Genome, Offspring]:
    """Return the founders of an experiment and their offspring."""
    founders = make_founders(experiment, KEY)
    lifetimes = make_lifetimes(founders, species=list_initial_species(experiment))
    return founders, make_offspring(experiment, CHILD_KEY, founders, fitness, lifetimes, arrays)


def test_agents_are_numbered_species_after_species() -> None:
    species = list_initial_species(make_experiment())
    assert species.tolist() == [0] * 8 + [1] * 12
    assert count_agents(species, 3).tolist() == [8, 12, 0]


def test_the_first_species_has_the_seed_of_the_study() -> None:
    seeds = [derive_seed(3, species) for species in range(16)]
    assert seeds[0] == 3
    assert len({*seeds}) == 16
    assert all(0 <= seed < 2**31 for seed in seeds)


def test_a_species_begins_with_the_founders_of_its_experiment() -> None:
    experiment = make_experiment()
    founders = make_founders(experiment, KEY)
    assert founders.shape == (20, 2, 60)
    learners, innate = experiment.species_experiments()
    assert np.array_equal(founders[:8], make_founders(learners, KEY))
    own_genomes = trim_genomes(founders[8:], innate)
    assert np.array_equal(
        own_genomes, make_founders(innate, KEY._replace(seed=derive_seed(KEY.seed, 1)))
    )
    assert not founders[8:, 1].any()


def test_competing_founders_have_all_modules() -> None:
    founders = make_founders(make_experiment(evolution={"compete": "across"}), KEY)
    separate_founders = make_founders(make_experiment(), KEY)
    assert np.array_equal(founders[:, 0], separate_founders[:, 0])
    assert founders[8:, 1].all()


def test_species_that_compete_within_evolve_as_separate_experiments() -> None:
    experiment = make_experiment(
        learners={
            "evolution": {"selection": "tournament", "elite": 2},
            "learning": {"rule": "self-taught", "teacher": "shuffled"},
        },
        innate={"network": {"hidden": [4]}},
    )
    species = list_initial_species(experiment)
    energy = np.arange(20.0) % 7
    founders, offspring = breed(experiment, energy)
    assert np.array_equal(offspring.species, species)
    for index, member, agents in iterate_members(experiment, species):
        genome, parents = make_generation(
            member,
            CHILD_KEY._replace(seed=derive_seed(CHILD_KEY.seed, index)),
            trim_genomes(founders[agents], member),
            energy[agents],
        )
        assert np.array_equal(trim_genomes(offspring.genome[agents], member), genome)
        assert np.array_equal(offspring.parents[agents], parents + agents.start)


def test_each_species_has_its_fitness_and_inheritance() -> None:
    experiment = make_experiment(learners={"evolution": {"lamarckian_share": 1.0}})
    species = list_initial_species(experiment)
    founders = make_founders(experiment, KEY)
    costs = np.arange(20.0)
    lifetimes = make_lifetimes(founders, np.full(20, 30.0), costs, species=species)
    learned = np.full((20, 60), 7, np.float32)
    inherited = inherit_within_species(experiment, lifetimes, learned)
    assert (inherited[:8, 0] == 7).all()
    assert np.array_equal(inherited[8:], founders[8:])
    assert np.array_equal(compute_species_fitness(experiment, lifetimes), 30 - costs)


def test_each_species_has_arrays_of_the_run() -> None:
    experiment = make_experiment(evolution={"fitness": "novelty", "selection": "tournament"})
    positions = np.random.default_rng(1).uniform(0, 640, (20, 2)).astype(np.float32)
    lifetimes = make_lifetimes(
        make_founders(experiment, KEY),
        position=positions,
        species=list_initial_species(experiment),
    )
    arrays: dict[int, Any] = {}
    first = compute_species_fitness(experiment, lifetimes, arrays)
    second = compute_species_fitness(experiment, lifetimes, arrays)
    assert not np.array_equal(first, second)
    for _, member, agents in iterate_members(experiment, lifetimes.species):
        member_arrays: dict[str, Any] = {}
        member_lifetimes = select_lifetimes(lifetimes, agents)
        for expected in (first, second):
            values = fitness(member, member_lifetimes, member_arrays)
            assert np.array_equal(values, expected[agents])


def test_without_parents_a_species_has_new_genomes() -> None:
    experiment = make_experiment(learners={"evolution": {"inheritance": "none"}})
    _, offspring = breed(experiment, np.ones(20))
    assert (offspring.parents[:8] == -1).all()
    assert (offspring.parents[8:] >= 8).all()


def test_a_child_of_competing_species_has_the_species_of_a_parent() -> None:
    experiment = make_experiment(evolution={"compete": "across"})
    species = list_initial_species(experiment)
    _, offspring = breed(experiment, np.arange(20.0))
    assert (np.diff(offspring.species) >= 0).all()
    species_of_parents = species[offspring.parents]
    assert (species_of_parents == offspring.species[:, None]).any(axis=1).all()
    assert (offspring.parents < 8).any()
    assert (offspring.parents >= 8).any()


def test_the_elite_of_competing_species_survives_unchanged() -> None:
    experiment = make_experiment(evolution={"compete": "across", "elite": 1})
    founders, offspring = breed(experiment, 1.0 * (np.arange(20) == 11))
    is_survivor = (offspring.genome == founders[11]).all(axis=(1, 2))
    assert is_survivor.any()
    assert (offspring.species == 1).all()


def test_identical_species_in_competition_evolve_as_one_species() -> None:
    single = bl.load("evo/A")
    two = single.replace(
        population={"species": [{"name": "a", "size": 8}, {"name": "b", "size": 12}]},
        evolution={"compete": "across"},
    )
    fitness = np.arange(20.0) % 5
    founders, offspring = breed(two, fitness)
    genome, parents = make_generation(single, CHILD_KEY, founders, fitness)
    # Children are sorted by species, and are otherwise equal.
    rows = np.concatenate([parents, genome[:, 0]], axis=1)
    sorted_rows = np.concatenate([offspring.parents, offspring.genome[:, 0]], axis=1)
    assert sorted(rows.tolist()) == sorted(sorted_rows.tolist())


def test_a_competing_species_makes_only_its_children() -> None:
    class CountedCrossover(Crossover, name="counted-crossover"):
        """Crossover that counts the children that it makes."""

        arrays: ClassVar[Mapping[str, Any]] = {"n_children": per_run(dtype="int32")}

        @staticmethod
        def vary(part: Any, mating: Mating) -> None:
            part.n_children[0] += 1
            vary_by_crossover(part, mating)

    counted, plain = (
        make_experiment(evolution={"compete": "across", "variation": variation})
        for variation in ("counted-crossover", "crossover")
    )
    arrays: dict[int, Any] = {}
    _, offspring = breed(counted, np.arange(20.0), arrays)
    n_children = [
        arrays[index]["variation.counted-crossover.n_children"].item() for index in (0, 1)
    ]
    assert n_children == count_agents(offspring.species, 2).tolist()
    assert np.array_equal(offspring.genome, breed(plain, np.arange(20.0))[1].genome)


@pytest.mark.parametrize("share", [0.0, 0.25, 1.0])
def test_the_species_of_a_child_is_that_of_a_random_parent(share: float) -> None:
    n_children = 4000
    experiment = bl.load("evo/A").replace(
        population={
            "size": n_children,
            "species": [{"name": "a", "size": 1000}, {"name": "b", "size": 3000}],
        },
        evolution={"compete": "across", "selection": "neutral"},
        network={"hidden": []},
    )
    # Fitness differs between the species, and neutral selection ignores it.
    fitness = np.where(list_initial_species(experiment) == 0, share, 1.0)
    _, offspring = breed(experiment, fitness)
    standard_error = np.sqrt(0.25 * 0.75 / n_children)
    assert abs((offspring.species == 0).mean() - 0.25) < 4 * standard_error
