"""Networks for the tests of NEAT."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import numpy.typing as npt

import baldwinlab as bl
from baldwinlab.evolution import GenerationKey, Genome
from baldwinlab.evolution.neat.genome import (
    BEST,
    GENE_SIZE,
    HEAD_SIZE,
    LAST_INNOVATION,
    LAST_SPECIES,
    SPECIES,
    STALE,
    make_minimal_graphs,
)
from baldwinlab.experiment import registry
from tests.evolution.single_runs import breed, draw_genomes
from tests.oracles.neat import Genes, read_genes

LINK_CAPACITY = 12
Graph = npt.NDArray[np.float32]


def make_network(*genes_of: tuple[float, float, float, float, float]) -> Graph:
    """Return a network of three inputs, one output and the given genes.

    A gene is (number, source, target, weight, enabled).
    """
    graph: Graph = make_minimal_graphs(3, 1, LINK_CAPACITY, np.zeros((1, 3)))[0]
    graph[HEAD_SIZE:] = 0
    graph[HEAD_SIZE : HEAD_SIZE + GENE_SIZE * len(genes_of)] = np.ravel(genes_of)
    graph[LAST_INNOVATION] = max(number for number, *_ in genes_of)
    return graph


def first_network(weights: tuple[float, float, float] = (0.1, 0.2, 0.3)) -> Graph:
    """Return a network in which the inputs 0 and 1 and the bias 2 are linked with the output 3."""
    graph: Graph = make_minimal_graphs(3, 1, LINK_CAPACITY, np.array([weights]))[0]
    return graph


def population(*graphs: Graph) -> Genome:
    """Return the genomes [agent, module, entry] of `graphs`, with the same last innovation."""
    genome = np.stack(graphs)[:, None]
    genome[:, 0, LAST_INNOVATION] = genome[:, 0, LAST_INNOVATION].max()
    return genome


def population_of_species(
    *numbers: int, stale: dict[int, int] | None = None, best: float = 0.0
) -> Genome:
    """Return one founder for each number of a species. All species have the best fitness `best`.

    `stale`: number of generations without a new best fitness, by number of the species.
    """
    genome = population(*(first_network() for _ in numbers))
    genome[:, 0, SPECIES] = numbers
    genome[:, 0, BEST] = best
    genome[:, 0, LAST_SPECIES] = max(numbers)
    for species, generations in (stale or {}).items():
        genome[genome[:, 0, SPECIES] == species, 0, STALE] = generations
    return genome


def neat_experiment(agents: int, neat_fields: dict[str, Any] | None = None, **changes: Any) -> Any:
    """Return a NEAT experiment in which only the given settings cause changes."""
    neat_settings = {"weight_mutation_rate": 0.0, "add_node_rate": 0.0, "add_link_rate": 0.0} | (
        neat_fields or {}
    )
    evolution = {"neat": neat_settings} | changes.pop("evolution", {})
    return bl.load("neat-xor").replace(
        population={"size": agents},
        neat_xor={"max_links": LINK_CAPACITY},
        evolution=evolution,
        **changes,
    )


def part_values_of(part: str = "neat", **fields: Any) -> Any:
    """Return the argument `part` of the hooks of a NEAT variation or selection."""
    kind = "variation" if part == "neat" else "selection"
    part_values = registry.find_class(kind, part)(**fields)
    return SimpleNamespace(**part_values.model_dump(), blind=False, loops=False)


def evolved(generations: int, agents: int = 40, seed: int = 1, **fields: Any) -> Genome:
    """Return a population of networks after fast growth under random fitness."""
    growing_experiment = bl.load("neat-xor").replace(
        population={"size": agents},
        neat_xor={"max_links": 30},
        evolution={"neat": {"add_node_rate": 0.2, "add_link_rate": 0.3} | fields},
    )
    random = np.random.default_rng(seed)
    genome = draw_genomes(growing_experiment, GenerationKey(seed, 0, 0))
    for generation in range(1, generations + 1):
        genome, _ = breed(
            growing_experiment, genome, random.random(agents), GenerationKey(seed, 0, generation)
        )
    return genome


def genes_of(graph: Graph) -> Genes:
    return read_genes(graph.tolist())
