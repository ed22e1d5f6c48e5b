"""NEAT variation: matching genes by innovation number, node and link mutations, and the ledger."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.stats import kstest

from baldwinlab.evolution import GenerationKey, Genome, breed
from baldwinlab.evolution.neat.genome import LAST_INNOVATION, count_entries
from tests.evolution.neat.grown import (
    first_network,
    genes_of,
    make_network,
    neat_experiment,
    population,
)

AGENTS = 300


def breed_children(
    genome: Genome, fitness: Any = None, generation: int = 1, cloned: bool = True, **fields: Any
) -> Genome:
    """Return the children of a population.

    `cloned` children have one parent, others two. Only the given fields cause mutations.
    """
    settings = neat_experiment(
        len(genome),
        fields,
        evolution={
            "species": {
                "single_parent_share": float(cloned),
                "survival_threshold": 1.0,
                "champion_species_size": 10**6,
            }
        },
    )
    values = np.ones(len(genome)) if fitness is None else np.asarray(fitness, float)
    return breed(settings, genome, values, GenerationKey(2, 0, generation))[0]


def equal_founders(count: int = AGENTS) -> Genome:
    return population(*[first_network()] * count)


def test_children_without_mutation_have_the_genes_of_their_parent() -> None:
    assert all(
        genes_of(child) == genes_of(first_network())
        for child in breed_children(equal_founders())[:, 0]
    )


def test_splitting_a_link_adds_a_node_and_two_links_and_disables_the_link() -> None:
    for child in breed_children(equal_founders(), add_node_rate=1.0)[:, 0]:
        child_genes = genes_of(child)
        assert len(child_genes) == 5
        (split,) = [number for number, gene in child_genes.items() if not gene[3]]
        node, onward = (number for number in child_genes if number > 6)
        assert child_genes[node] == [child_genes[split][0], node, 1.0, 1.0]
        assert child_genes[onward] == [node, child_genes[split][1], child_genes[split][2], 1.0]


def test_any_enabled_link_can_be_split_except_links_from_the_bias() -> None:
    graph = make_network(
        (4, 0, 3, 1, 0), (5, 1, 3, 1, 1), (6, 2, 3, 1, 1), (7, 0, 7, 1, 1), (8, 7, 3, 1, 0)
    )
    children = breed_children(population(*[graph] * AGENTS), add_node_rate=1.0)[:, 0]
    split = [
        source
        for child in children
        for number, (source, _, _, _) in genes_of(child).items()
        if number > 8 and source < 3
    ]
    assert set(split) == {0, 1}
    assert abs(split.count(1) - AGENTS / 2) < 4 * np.sqrt(AGENTS) / 2


def test_equal_innovations_in_a_generation_have_the_same_numbers() -> None:
    children = breed_children(equal_founders(), add_node_rate=1.0)
    by_source = {
        (number, *gene[:2])
        for child in children[:, 0]
        for number, gene in genes_of(child).items()
        if number > 6
    }
    assert len(by_source) == 4, "two splits, of two links each"
    assert {number for number, *_ in by_source} == set(range(7, 11))
    assert (children[:, 0, LAST_INNOVATION] == 10).all()


def test_an_equal_innovation_in_a_later_generation_has_new_numbers() -> None:
    first = breed_children(equal_founders(), add_node_rate=1.0)
    founders = equal_founders()
    founders[:, 0, LAST_INNOVATION] = first[0, 0, LAST_INNOVATION]
    later = breed_children(founders, generation=2, add_node_rate=1.0)
    assert {number for child in later[:, 0] for number in genes_of(child)} == {
        4,
        5,
        6,
        *range(11, 15),
    }


def test_a_new_link_connects_nodes_that_were_not_connected() -> None:
    graph = make_network(
        (4, 0, 3, 1, 0), (5, 1, 3, 1, 1), (6, 2, 3, 1, 1), (7, 0, 7, 1, 1), (8, 7, 3, 1, 1)
    )
    children = breed_children(population(*[graph] * AGENTS), add_link_rate=1.0, weight_range=2.0)[
        :, 0
    ]
    new = [
        (number, *genes_of(child)[number])
        for child in children
        for number in genes_of(child)
        if number > 8
    ]
    assert {(source, target) for _, source, target, _, _ in new} == {(1, 7), (2, 7)}
    assert {number for number, *_ in new} == {9, 10}
    assert kstest([weight for *_, weight, _ in new], "uniform", (-2, 4)).pvalue > 0.001


def test_fully_connected_or_full_graphs_do_not_grow() -> None:
    assert all(
        len(genes_of(child)) == 3
        for child in breed_children(equal_founders(), add_link_rate=1.0)[:, 0]
    )
    settings = neat_experiment(20, {"add_node_rate": 1.0}).replace(neat_xor={"max_links": 4})
    genome = np.ascontiguousarray(equal_founders(20)[:, :, : count_entries(4)])
    children, _ = breed(settings, genome, np.ones(20), GenerationKey(1, 0, 1))
    assert all(len(genes_of(child)) == 3 for child in children[:, 0])


def test_weights_are_perturbed_or_replaced_with_the_given_probabilities() -> None:
    founders = population(*[first_network((10, 10, 10))] * AGENTS)
    weights = np.array(
        [
            [gene[2] for gene in genes_of(child).values()]
            for child in breed_children(founders, weight_mutation_rate=0.8)[:, 0]
        ]
    )
    untouched = (weights == 10).all(axis=1)
    assert abs(untouched.mean() - 0.2) < 4 * np.sqrt(0.16 / AGENTS)
    changed = weights[~untouched].ravel()
    perturbed = changed > 5
    assert abs(perturbed.mean() - 0.9) < 4 * np.sqrt(0.09 / changed.size)


def two_parents() -> tuple[Any, Any]:
    """Return two networks with common genes and different hidden nodes and disabled genes."""
    first = make_network(
        (4, 0, 3, 1, 0), (5, 1, 3, 1, 1), (6, 2, 3, 1, 1), (7, 0, 7, 1, 1), (8, 7, 3, 1, 1)
    )
    second = make_network(
        (4, 0, 3, -1, 1), (5, 1, 3, -1, 0), (6, 2, 3, -1, 1), (9, 2, 9, -1, 1), (10, 9, 3, -1, 1)
    )
    return first, second


@pytest.mark.parametrize("fitter", [0, 1])
def test_genes_of_one_parent_are_inherited_from_the_fitter_parent(fitter: int) -> None:
    graphs = two_parents()
    fitness = [1.0 + (number % 2 == fitter) for number in range(AGENTS)]
    children = breed_children(population(*graphs * (AGENTS // 2)), fitness, cloned=False)[:, 0]
    for child in children:
        assert set(genes_of(child)) in (set(genes_of(graphs[0])), set(genes_of(graphs[1])))
    crossed = [
        genes_of(child)
        for child in children
        if len({gene[2] for gene in genes_of(child).values()}) == 2
    ]
    assert crossed
    assert all(set(child_genes) == set(genes_of(graphs[fitter])) for child_genes in crossed)
    chosen = np.array([child_genes[number][2] for child_genes in crossed for number in (4, 5, 6)])
    # The weight of a matching gene comes from either parent.
    assert 0.35 < (chosen == 1).mean() < 0.65


def test_the_structure_of_a_random_parent_is_inherited_if_fitness_is_equal() -> None:
    children = breed_children(population(*two_parents() * (AGENTS // 2)), cloned=False)[:, 0]
    share_of_first = np.mean([7 in genes_of(child) for child in children])
    assert abs(share_of_first - 0.5) < 4 * 0.5 / np.sqrt(AGENTS)


def test_a_link_disabled_in_one_parent_is_enabled_in_a_quarter_of_the_children() -> None:
    fitness = [2.0, 1.0] * (AGENTS // 2)
    children = breed_children(population(*two_parents() * (AGENTS // 2)), fitness, cloned=False)[
        :, 0
    ]
    crossed = [
        genes_of(child)
        for child in children
        if len({gene[2] for gene in genes_of(child).values()}) == 2
    ]
    enabled = np.array([child_genes[number][3] for child_genes in crossed for number in (4, 5)])
    assert abs(enabled.mean() - 0.25) < 4 * np.sqrt(0.1875 / enabled.size)
    assert all(child_genes[number][3] for child_genes in crossed for number in (6, 7, 8))
