"""How children's networks come of their parents': alleles by historical marks, splits, links, and a ledger that gives numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.stats import kstest

from baldwinlab.evolution import GenerationKey, Genome, breed
from baldwinlab.evolution.neat.genome import LEDGER, count_entries
from tests.evolution.neat.grown import experiment, first_network, genes, network, population

AGENTS = 300


def bred(
    genome: Genome, fitness: Any = None, generation: int = 1, cloned: bool = True, **fields: Any
) -> Genome:
    """Children of a population, each of one parent or of two, in which nothing mutates but as the fields say."""
    of = experiment(
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
    alike = np.ones(len(genome)) if fitness is None else np.asarray(fitness, float)
    return breed(of, genome, alike, GenerationKey(2, 0, generation))[0]


def alike(count: int = AGENTS) -> Genome:
    return population(*[first_network()] * count)


def test_where_nothing_mutates_children_have_their_parent_s_genes() -> None:
    assert all(genes(child) == genes(first_network()) for child in bred(alike())[:, 0])


def test_a_split_adds_a_node_and_two_links_and_disables_one() -> None:
    for child in bred(alike(), add_node_rate=1.0)[:, 0]:
        found = genes(child)
        assert len(found) == 5
        (split,) = [number for number, gene in found.items() if not gene[3]]
        node, onward = (number for number in found if number > 6)
        assert found[node] == [found[split][0], node, 1.0, 1.0]
        assert found[onward] == [node, found[split][1], found[split][2], 1.0]


def test_any_enabled_link_is_split_but_for_those_from_the_bias() -> None:
    graph = network(
        (4, 0, 3, 1, 0), (5, 1, 3, 1, 1), (6, 2, 3, 1, 1), (7, 0, 7, 1, 1), (8, 7, 3, 1, 0)
    )
    children = bred(population(*[graph] * AGENTS), add_node_rate=1.0)[:, 0]
    split = [
        source
        for child in children
        for number, (source, _, _, _) in genes(child).items()
        if number > 8 and source < 3
    ]
    assert set(split) == {0, 1} and abs(split.count(1) - AGENTS / 2) < 4 * np.sqrt(AGENTS) / 2


def test_the_same_structure_that_arises_twice_in_a_generation_gets_the_same_numbers() -> None:
    children = bred(alike(), add_node_rate=1.0)
    by_source = {
        (number, *gene[:2])
        for child in children[:, 0]
        for number, gene in genes(child).items()
        if number > 6
    }
    assert len(by_source) == 4, "two splits, of two links each"
    assert {number for number, *_ in by_source} == set(range(7, 11))
    assert (children[:, 0, LEDGER] == 10).all()


def test_in_a_later_generation_it_is_another_innovation() -> None:
    first = bred(alike(), add_node_rate=1.0)
    founders = alike()
    founders[:, 0, LEDGER] = first[0, 0, LEDGER]
    later = bred(founders, generation=2, add_node_rate=1.0)
    assert {number for child in later[:, 0] for number in genes(child)} == {4, 5, 6, *range(11, 15)}


def test_a_new_link_joins_nodes_that_were_not_joined() -> None:
    graph = network(
        (4, 0, 3, 1, 0), (5, 1, 3, 1, 1), (6, 2, 3, 1, 1), (7, 0, 7, 1, 1), (8, 7, 3, 1, 1)
    )
    children = bred(population(*[graph] * AGENTS), add_link_rate=1.0, weight_range=2.0)[:, 0]
    new = [
        (number, *genes(child)[number])
        for child in children
        for number in genes(child)
        if number > 8
    ]
    assert {(source, target) for _, source, target, _, _ in new} == {(1, 7), (2, 7)}
    assert {number for number, *_ in new} == {9, 10}
    assert kstest([weight for *_, weight, _ in new], "uniform", (-2, 4)).pvalue > 0.001


def test_where_all_is_joined_or_there_is_no_room_nothing_is_added() -> None:
    assert all(len(genes(child)) == 3 for child in bred(alike(), add_link_rate=1.0)[:, 0])
    of = experiment(20, {"add_node_rate": 1.0}).replace(neat_xor={"max_links": 4})
    genome = np.ascontiguousarray(alike(20)[:, :, : count_entries(4)])
    children, _ = breed(of, genome, np.ones(20), GenerationKey(1, 0, 1))
    assert all(len(genes(child)) == 3 for child in children[:, 0])


def test_weights_are_perturbed_or_drawn_anew_as_often_as_is_said() -> None:
    founders = population(*[first_network((10, 10, 10))] * AGENTS)
    weights = np.array(
        [
            [gene[2] for gene in genes(child).values()]
            for child in bred(founders, weight_mutation_rate=0.8)[:, 0]
        ]
    )
    untouched = (weights == 10).all(axis=1)
    assert abs(untouched.mean() - 0.2) < 4 * np.sqrt(0.16 / AGENTS)
    changed = weights[~untouched].ravel()
    perturbed = changed > 5
    assert abs(perturbed.mean() - 0.9) < 4 * np.sqrt(0.09 / changed.size)


def parents() -> tuple[Any, Any]:
    """Two with genes in common, of which one alone has a node, the other a gene that was disabled."""
    one = network(
        (4, 0, 3, 1, 0), (5, 1, 3, 1, 1), (6, 2, 3, 1, 1), (7, 0, 7, 1, 1), (8, 7, 3, 1, 1)
    )
    other = network(
        (4, 0, 3, -1, 1), (5, 1, 3, -1, 0), (6, 2, 3, -1, 1), (9, 2, 9, -1, 1), (10, 9, 3, -1, 1)
    )
    return one, other


@pytest.mark.parametrize("fitter", [0, 1])
def test_what_only_one_parent_has_comes_from_the_fitter_one(fitter: int) -> None:
    graphs = parents()
    fitness = [1.0 + (number % 2 == fitter) for number in range(AGENTS)]
    children = bred(population(*graphs * (AGENTS // 2)), fitness, cloned=False)[:, 0]
    for child in children:
        assert set(genes(child)) in (set(genes(graphs[0])), set(genes(graphs[1])))
    crossed = [
        genes(child) for child in children if len({gene[2] for gene in genes(child).values()}) == 2
    ]
    assert crossed and all(set(found) == set(genes(graphs[fitter])) for found in crossed)
    chosen = np.array([found[number][2] for found in crossed for number in (4, 5, 6)])
    assert 0.35 < (chosen == 1).mean() < 0.65, "the weight of a matching gene is either parent's"


def test_of_parents_that_are_equally_fit_a_coin_says_whose_structure_is_inherited() -> None:
    children = bred(population(*parents() * (AGENTS // 2)), cloned=False)[:, 0]
    of_one = np.mean([7 in genes(child) for child in children])
    assert abs(of_one - 0.5) < 4 * 0.5 / np.sqrt(AGENTS)


def test_a_link_that_a_parent_has_disabled_is_enabled_again_in_one_child_of_four() -> None:
    one, other = parents()
    fitness = [2.0, 1.0] * (AGENTS // 2)
    children = bred(population(*(one, other) * (AGENTS // 2)), fitness, cloned=False)[:, 0]
    crossed = [
        genes(child) for child in children if len({gene[2] for gene in genes(child).values()}) == 2
    ]
    enabled = np.array([found[number][3] for found in crossed for number in (4, 5)])
    assert abs(enabled.mean() - 0.25) < 4 * np.sqrt(0.1875 / enabled.size)
    assert all(found[number][3] for found in crossed for number in (6, 7, 8))
