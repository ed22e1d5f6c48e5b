"""NEAT variation: matching genes by innovation number, node and link mutations, and the ledger."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.api.checks.evolution import compare_children, compare_selection
from baldwinlab.evolution import GenerationKey, Genome
from baldwinlab.evolution.neat.genome import LAST_INNOVATION
from baldwinlab.evolution.neat.operators import Neat, SpeciesSelection
from baldwinlab.experiment import assign
from tests.evolution.neat.grown import (
    first_network,
    genes_of,
    make_network,
    neat_experiment,
    population,
)
from tests.evolution.single_runs import breed
from tests.oracles.parts import use_oracles

AGENTS = 300
FAST = ["evolution.neat.add_node_rate=0.3", "evolution.neat.add_link_rate=0.5"]
MANY_SPECIES = ["evolution.neat.compatibility_threshold=1", "evolution.neat.weight_coefficient=1"]


@pytest.mark.parametrize(
    "settings",
    [
        [*FAST, "neat_xor.max_links=20"],
        [*FAST, "neat_xor.max_links=6"],
        [*MANY_SPECIES, "evolution.species.interspecies_mating_rate=0.3"],
    ],
    ids=["growing", "full", "many species"],
)
def test_parents_and_children_of_forty_generations_equal_the_oracle(settings: list[str]) -> None:
    group: Any = SimpleNamespace(experiment=assign(bl.load("neat-xor"), settings), seed=3)
    with use_oracles():
        compare_children(group, Neat)
        compare_selection(group, SpeciesSelection)


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


def test_splitting_a_link_adds_a_node_and_two_links_and_disables_the_link() -> None:
    for child in breed_children(equal_founders(), add_node_rate=1.0)[:, 0]:
        child_genes = genes_of(child)
        assert len(child_genes) == 5
        (split,) = [number for number, gene in child_genes.items() if not gene[3]]
        node, onward = (number for number in child_genes if number > 6)
        assert child_genes[node] == [child_genes[split][0], node, 1.0, 1.0]
        assert child_genes[onward] == [node, child_genes[split][1], child_genes[split][2], 1.0]


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
