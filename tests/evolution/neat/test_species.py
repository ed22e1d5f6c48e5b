"""NEAT species: distances, membership, and the number of children per species."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from baldwinlab.engine import rng
from baldwinlab.evolution import GenerationKey, Genome, Parents
from baldwinlab.evolution.neat.genome import (
    POPULATION_BEST,
    POPULATION_STALE,
    SPECIES,
)
from baldwinlab.evolution.neat.species import distance
from baldwinlab.parts.breeding import ITSELF
from baldwinlab.parts.lifetimes import make_lifetimes
from tests.evolution.neat.grown import (
    evolved,
    first_network,
    genes_of,
    make_network,
    neat_experiment,
    part_values_of,
    population,
    population_of_species,
)
from tests.evolution.single_runs import breed, select
from tests.oracles import neat as oracle

NEAT = part_values_of()


def select_parents(genome: Genome, fitness: Any, generation: int = 1, **species: Any) -> Parents:
    settings = neat_experiment(
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
    return select(settings, np.asarray(fitness, float), uniforms, make_lifetimes(genome))


def count_children(parents: Parents, genome: Genome) -> dict[int, int]:
    """Return the number of children of each species."""
    species, counts = np.unique(genome[parents[:, 0], 0, SPECIES], return_counts=True)
    return dict(zip(species.astype(int).tolist(), counts.tolist(), strict=True))


def test_the_distance_of_small_networks_counts_disjoint_and_excess_genes() -> None:
    first = make_network((4, 0, 3, 1, 1), (5, 1, 3, 1, 1), (7, 0, 7, 1, 1), (8, 7, 3, 1, 1))
    second = make_network((4, 0, 3, 1, 1), (5, 1, 3, 2, 0), (6, 2, 3, 5, 1))
    coefficients = part_values_of(
        excess_coefficient=2.0, disjoint_coefficient=3.0, weight_coefficient=0.5
    )
    # Gene 6 is disjoint, genes 7 and 8 are excess.
    expected = pytest.approx(2 * 2 + 3 * 1 + 0.5 * 0.5)
    assert distance(coefficients, first, second) == expected
    assert distance(coefficients, second, first) == expected


def test_distances_equal_the_oracle() -> None:
    """Most of these networks are so large that the distance is relative to the number of genes."""
    for first, second in pairwise(evolved(40)[:, 0]):
        assert distance(NEAT, first, second) == pytest.approx(
            oracle.distance(NEAT, genes_of(first), genes_of(second)), abs=1e-6
        )


def test_species_have_children_in_proportion_to_their_mean_fitness() -> None:
    """With explicit fitness sharing, the sum of f / size in a species is its mean fitness."""
    genome = population_of_species(*[1] * 4, *[2] * 12, *[3] * 8)
    fitness = [4.0] * 4 + [1.0] * 12 + [1.0] * 8
    assert count_children(select_parents(genome, fitness), genome) == {1: 16, 2: 4, 3: 4}
    # If all fitness values are 0, each species has the same number of children.
    assert count_children(select_parents(genome, [0.0] * 24), genome) == {1: 8, 2: 8, 3: 8}


def test_the_champion_of_a_species_with_more_than_five_members_survives() -> None:
    genome = population_of_species(*[1] * 6, *[2] * 5)
    fitness = np.arange(11.0) % 6 + 1
    parents = select_parents(genome, fitness, champion_species_size=5)
    assert parents[parents[:, 1] == ITSELF].tolist() == [[5, ITSELF]]
    settings = neat_experiment(
        11,
        {"weight_mutation_rate": 1.0, "add_node_rate": 1.0},
        evolution={"species": {"champion_species_size": 5}},
    )
    children, recorded = breed(settings, genome, fitness, GenerationKey(1, 0, 1))
    (survivor,) = np.flatnonzero(
        [genes_of(child) == genes_of(genome[5, 0]) for child in children[:, 0]]
    )
    assert recorded[survivor].tolist() == [5, 5]


def test_after_a_long_stagnation_only_the_two_best_species_have_children() -> None:
    genome = population_of_species(*[1] * 4, *[2] * 4, *[3] * 4, *[4] * 4, stale={3: 40}, best=9.0)
    genome[:, 0, POPULATION_BEST] = 9.0
    fitness = [1.0] * 4 + [2.0] * 4 + [3.0] * 4 + [1.5] * 4
    for stale, breeding in ((19, {1, 2, 4}), (20, {2, 3}), (21, {1, 2, 3, 4}), (41, {2, 3})):
        genome[:, 0, POPULATION_STALE] = stale
        assert count_children(select_parents(genome, fitness), genome).keys() == breeding, stale


def test_neutral_selection_ignores_fitness_when_it_inherits_structure() -> None:
    with_node = make_network(
        (4, 0, 3, 1, 1), (5, 1, 3, 1, 1), (6, 2, 3, 1, 1), (7, 0, 7, 1, 1), (8, 7, 3, 1, 1)
    )
    genome = population(*[with_node, first_network()] * 200)
    fitness = np.tile([1.0, 2.0], 200)

    def share_with_node(settings: Any) -> float:
        children, _ = breed(settings, genome, fitness, GenerationKey(2, 0, 1))
        return float(np.mean([7 in genes_of(child) for child in children[:, 0]]))

    neutral = neat_experiment(400).neutral_control()
    assert abs(share_with_node(neutral) - 0.5) < 4 * 0.5 / 20
    # With selection, the structure of the fitter parent is inherited.
    assert share_with_node(neat_experiment(400, evolution={"selection": "tournament"})) < 0.3
