"""Species: distances by hand, who is of which, who has how many children, and who none."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from baldwinlab.engine import rng
from baldwinlab.evolution import GenerationKey, Genome, Parents, breed, select
from baldwinlab.evolution.neat import oracle
from baldwinlab.evolution.neat.genome import BEST, BEST_OF_ALL, NEWEST, SPECIES, STALE, STALE_OF_ALL
from baldwinlab.evolution.neat.species import SMALL_NETWORK, distance
from baldwinlab.parts.breeding import ITSELF
from tests.evolution.neat.grown import (
    evolved,
    experiment,
    first_network,
    genes,
    network,
    of_species,
    population,
    values,
)

NEAT = values()


def chosen(genome: Genome, fitness: Any, generation: int = 1, **species: Any) -> Parents:
    of = experiment(
        len(genome),
        evolution={
            "species": {
                "single_parent_share": 0.0,
                "champion_species_size": 10**6,
                "survival_threshold": 1.0,
            }
            | species
        },
    )
    uniforms = GenerationKey(3, 0, generation).uniforms(rng.SELECTION, (len(genome), 2))
    return select(of, np.asarray(fitness, float), uniforms, genome)


def children_of(parents: Parents, genome: Genome) -> dict[int, int]:
    """How many children each species has."""
    species, counts = np.unique(genome[parents[:, 0], 0, SPECIES], return_counts=True)
    return dict(zip(species.astype(int).tolist(), counts.tolist(), strict=True))


def test_equal_networks_have_no_distance() -> None:
    assert distance(NEAT, first_network(), first_network()) == 0


def test_weights_alone_count_by_their_mean_difference() -> None:
    assert distance(NEAT, first_network((1, 2, 3)), first_network((2, 0, 3))) == pytest.approx(
        0.4 * (1 + 2 + 0) / 3
    )


def test_disjoint_and_excess_genes_count_one_by_one_in_small_networks() -> None:
    one = network((4, 0, 3, 1, 1), (5, 1, 3, 1, 1), (7, 0, 7, 1, 1), (8, 7, 3, 1, 1))
    other = network((4, 0, 3, 1, 1), (5, 1, 3, 2, 0), (6, 2, 3, 5, 1))
    there = values(
        excess_coefficient=2.0, disjoint_coefficient=3.0, weight_coefficient=0.5
    )  # number 6 is disjoint, 7 and 8 are excess
    assert (
        distance(there, one, other)
        == distance(there, other, one)
        == pytest.approx(2 * 2 + 3 * 1 + 0.5 * 0.5)
    )


def test_large_networks_are_compared_by_shares_of_their_genes() -> None:
    from baldwinlab.evolution.neat.genome import HEAD, count_entries

    def large(links: int) -> Any:
        graph = np.zeros(count_entries(30), np.float32)
        graph[:HEAD] = first_network()[:HEAD]
        for link in range(links):
            graph[HEAD + 5 * link : HEAD + 5 * link + 5] = 4 + link, 0, 3, 1, 1
        return graph

    assert distance(NEAT, large(SMALL_NETWORK - 1), large(SMALL_NETWORK - 3)) == 2
    assert distance(NEAT, large(SMALL_NETWORK), large(SMALL_NETWORK - 3)) == pytest.approx(
        3 / SMALL_NETWORK
    )


def test_distances_are_the_oracle_s() -> None:
    for one, other in pairwise(evolved(40)[:, 0]):
        assert distance(NEAT, one, other) == pytest.approx(
            oracle.distance(NEAT, genes(one), genes(other)), abs=1e-6
        )


def test_a_child_is_of_the_oldest_species_that_is_near_and_founds_one_where_none_is() -> None:
    near, far = first_network((0, 0, 0)), first_network((30, 30, 30))
    genome = population(near, near, far, far, far)
    genome[:, 0, SPECIES], genome[:, 0, NEWEST] = 4, 6
    of = experiment(5, evolution={"selection": "best-copies", "best_copies": {"parent_share": 1.0}})
    children, parents = breed(of, genome, np.arange(5.0), GenerationKey(1, 0, 1))
    species = {
        int(parent): int(child[0, SPECIES])
        for parent, child in zip(parents[:, 0], children, strict=True)
    }
    assert species in ({0: 4, 1: 4, 2: 7, 3: 7, 4: 7}, {0: 7, 1: 7, 2: 4, 3: 4, 4: 4}), (
        "anybody stands for species 4"
    )
    assert (children[:, 0, NEWEST] == 7).all()


def test_species_have_children_in_proportion_to_their_mean_fitness() -> None:
    """Explicit fitness sharing: a species' sum of f / size is its mean, however large it is."""
    genome = of_species(*[1] * 4, *[2] * 12, *[3] * 8)
    fitness = [4.0] * 4 + [1.0] * 12 + [1.0] * 8
    assert children_of(chosen(genome, fitness), genome) == {1: 16, 2: 4, 3: 4}
    assert children_of(chosen(genome, [0.0] * 24), genome) == {1: 8, 2: 8, 3: 8}, (
        "all are alike if nobody has any fitness"
    )


def test_parents_are_of_one_species_and_of_the_best_of_it() -> None:
    genome, fitness = of_species(*[1] * 20, *[2] * 20), np.arange(40) % 20 + 1.0
    parents = np.concatenate(
        [
            chosen(
                genome, fitness, generation, survival_threshold=0.2, interspecies_mating_rate=0.0
            )
            for generation in range(1, 60)
        ]
    )
    assert set(parents.ravel().tolist()) == {15, 16, 17, 18, 19, 35, 36, 37, 38, 39}, (
        "a fifth and one more"
    )
    assert (genome[parents[:, 0], 0, SPECIES] == genome[parents[:, 1], 0, SPECIES]).all()


def test_now_and_then_the_other_parent_is_anybody() -> None:
    genome = of_species(*[1] * 20, *[2] * 20)
    parents = chosen(genome, np.ones(40), interspecies_mating_rate=1.0, survival_threshold=0.0)
    assert len(set(parents.ravel().tolist())) > 15


def test_some_children_have_one_parent() -> None:
    genome = of_species(*[1] * 1000)
    parents = chosen(genome, np.ones(1000), single_parent_share=0.25)
    assert (
        abs((parents[:, 0] == parents[:, 1]).mean() - 0.25) < 4 * np.sqrt(0.1875 / 1000) + 1 / 1000
    )


def test_the_champion_of_a_species_with_more_than_five_members_lives_on() -> None:
    genome = of_species(*[1] * 6, *[2] * 5)
    fitness = np.arange(11.0) % 6 + 1
    parents = chosen(genome, fitness, champion_species_size=5)
    assert parents[parents[:, 1] == ITSELF].tolist() == [[5, ITSELF]]
    of = experiment(
        11,
        {"weight_mutation_rate": 1.0, "add_node_rate": 1.0},
        evolution={"species": {"champion_species_size": 5}},
    )
    children, recorded = breed(of, genome, fitness, GenerationKey(1, 0, 1))
    (place,) = np.flatnonzero([genes(child) == genes(genome[5, 0]) for child in children[:, 0]])
    assert recorded[place].tolist() == [5, 5]


def test_a_species_without_a_gain_for_fifteen_generations_has_no_children() -> None:
    genome = of_species(*[1] * 5, *[2] * 5, *[3] * 5, stale={1: 13, 2: 14, 3: 14}, best=1.0)
    fitness = [1.0] * 10 + [2.0] * 5  # the third gains now
    assert children_of(chosen(genome, fitness), genome).keys() == {1, 3}
    everybody_stale = of_species(*[1] * 5, *[2] * 5, stale={1: 30, 2: 30}, best=9.0)
    assert children_of(chosen(everybody_stale, [1.0] * 10), everybody_stale).keys() == {1, 2}, (
        "or there would be no children"
    )


def test_where_nobody_gains_for_long_the_two_best_species_alone_breed() -> None:
    genome = of_species(*[1] * 4, *[2] * 4, *[3] * 4, *[4] * 4, stale={3: 40}, best=9.0)
    genome[:, 0, BEST_OF_ALL] = 9.0
    fitness = [1.0] * 4 + [2.0] * 4 + [3.0] * 4 + [1.5] * 4
    for stale, breeding in ((19, {1, 2, 4}), (20, {2, 3}), (21, {1, 2, 3, 4}), (41, {2, 3})):
        genome[:, 0, STALE_OF_ALL] = stale
        assert children_of(chosen(genome, fitness), genome).keys() == breeding, stale


def test_how_a_species_stands_is_handed_on() -> None:
    genome = of_species(*[1] * 6, *[2] * 6, stale={1: 3, 2: 5}, best=2.0)
    genome[6:, 0] = np.stack([first_network((30, 30, 30))] * 6)
    genome[6:, 0, SPECIES], genome[6:, 0, STALE], genome[:, 0, BEST], genome[:, 0, NEWEST] = (
        2,
        5,
        2.0,
        2,
    )
    fitness = [1.0] * 6 + [4.0] * 6
    children, _ = breed(experiment(12), genome, np.array(fitness), GenerationKey(1, 0, 1))
    heads = {(int(head[SPECIES]), float(head[BEST]), int(head[STALE])) for head in children[:, 0]}
    assert heads == {(1, 2.0, 4), (2, 4.0, 0)}


def test_with_parents_at_random_fitness_does_not_say_whose_structure_is_inherited() -> None:
    """So parents at random are a neutral twin."""
    with_node = network(
        (4, 0, 3, 1, 1), (5, 1, 3, 1, 1), (6, 2, 3, 1, 1), (7, 0, 7, 1, 1), (8, 7, 3, 1, 1)
    )
    genome = population(*[with_node, first_network()] * 200)
    fitness = np.tile([1.0, 2.0], 200)
    of_half, of_few = (
        np.mean(
            [
                7 in genes(child)
                for child in breed(of, genome, fitness, GenerationKey(2, 0, 1))[0][:, 0]
            ]
        )
        for of in (
            experiment(400).neutral_control(),
            experiment(400, evolution={"selection": "tournament"}),
        )
    )
    assert abs(of_half - 0.5) < 4 * 0.5 / 20
    assert of_few < 0.3, "with selection, the fitter ones' structure is"
