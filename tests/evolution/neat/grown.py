"""Networks for the tests of NEAT, and what can be read off their genomes."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import numpy.typing as npt

import baldwinlab as bl
from baldwinlab.evolution import GenerationKey, Genome, breed, draw_genomes
from baldwinlab.evolution.neat.genome import (
    BEST,
    GENE,
    HEAD,
    LEDGER,
    NEWEST,
    SPECIES,
    STALE,
    make_minimal_graphs,
)
from baldwinlab.evolution.neat.oracle import Genes, read_genes
from baldwinlab.experiment import registry

ROOM = 12
Graph = npt.NDArray[np.float32]


def network(*genes: tuple[float, float, float, float, float]) -> Graph:
    """Three inputs, one output, and these genes: (number, source, target, weight, enabled)."""
    graph: Graph = make_minimal_graphs(3, 1, ROOM, np.zeros((1, 3)))[0]
    graph[HEAD:] = 0
    graph[HEAD : HEAD + GENE * len(genes)] = np.ravel(genes)
    graph[LEDGER] = max(number for number, *_ in genes)
    return graph


def first_network(weights: tuple[float, float, float] = (0.1, 0.2, 0.3)) -> Graph:
    """Inputs 0, 1 and the bias 2, each linked with the output 3."""
    graph: Graph = make_minimal_graphs(3, 1, ROOM, np.array([weights]))[0]
    return graph


def population(*graphs: Graph) -> Genome:
    """[agent, module, entry], with one ledger."""
    genome = np.stack(graphs)[:, None]
    genome[:, 0, LEDGER] = genome[:, 0, LEDGER].max()
    return genome


def of_species(*numbers: int, stale: dict[int, int] | None = None, best: float = 0.0) -> Genome:
    """Founders' networks that are said to be of these species, which never had more than `best`."""
    genome = population(*(first_network() for _ in numbers))
    genome[:, 0, SPECIES], genome[:, 0, BEST], genome[:, 0, NEWEST] = numbers, best, max(numbers)
    for species, generations in (stale or {}).items():
        genome[genome[:, 0, SPECIES] == species, 0, STALE] = generations
    return genome


def experiment(agents: int, neat_fields: dict[str, Any] | None = None, **changes: Any) -> Any:
    """NEAT in which nothing changes but what is given."""
    still = {"weight_mutation_rate": 0.0, "add_node_rate": 0.0, "add_link_rate": 0.0} | (
        neat_fields or {}
    )
    evolution = {"neat": still} | changes.pop("evolution", {})
    return bl.load("neat-xor").replace(
        population={"size": agents}, neat_xor={"max_links": ROOM}, evolution=evolution, **changes
    )


def values(part: str = "neat", **fields: Any) -> Any:
    """A part's numbers, as its hooks have them."""
    kind = "variation" if part == "neat" else "selection"
    made = registry.find(kind, part)(**fields)
    return SimpleNamespace(**made.model_dump(), blind=False, loops=False)


def evolved(generations: int, agents: int = 40, seed: int = 1, **fields: Any) -> Genome:
    """A population of networks that grow fast, under a fitness that is drawn."""
    growing = bl.load("neat-xor").replace(
        population={"size": agents},
        neat_xor={"max_links": 30},
        evolution={"neat": {"add_node_rate": 0.2, "add_link_rate": 0.3} | fields},
    )
    random, genome = np.random.default_rng(seed), draw_genomes(growing, GenerationKey(seed, 0, 0))
    for generation in range(1, generations + 1):
        genome, _ = breed(
            growing, genome, random.random(agents), GenerationKey(seed, 0, generation)
        )
    return genome


def genes(graph: Graph) -> Genes:
    return read_genes(graph.tolist())
