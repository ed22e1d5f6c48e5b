"""Genomes that are graphs: networks of any topology, each link a gene with its historical mark.

A genome is float32 [entry]: a head of `CHECKSUM_BYTES` entries, then a gene of `GENE` entries for each link, in the order of their
innovation numbers; where that number is 0, there are no more. Nodes are named by whole numbers: the inputs from 0 on,
the last of them the bias, then the outputs; a hidden node has the innovation number of the link that led to it when it arose.
So a genome says all by itself which nodes it has, and no list of nodes is needed.

Source: K. O. Stanley and R. Miikkulainen, "Evolving neural networks through augmenting topologies", Evolutionary Computation
10 (2002), sections 3.1 and 3.2; how it lies in an array is ours.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import numpy.typing as npt

from baldwinlab.engine.arithmetic import sigmoid
from baldwinlab.engine.jit import compiled

# The head: what all share (nodes, and the ledger of the run, the last numbers given), then the standing of the species.
INPUTS, OUTPUTS, LEDGER, NEWEST, SPECIES, BEST, STALE, BEST_OF_ALL, STALE_OF_ALL = range(9)
HEAD: Final = 9
INFINITE_GENES: Final = (BEST, BEST_OF_ALL)  # minus infinity until a species has been evaluated
NUMBER, SOURCE, TARGET, WEIGHT, ENABLED = range(5)  # of a gene
GENE: Final = 5

Graph = npt.NDArray[np.float32]  # [entry]
ZERO, ONE = np.float32(0), np.float32(1)
UNKNOWN = np.float32(-1)  # what no node answers


def require_neat(experiment: Any, holder: str) -> None:
    """Raises ValueError where another variation than `neat` would make genomes that are no graphs."""
    evolution = experiment.evolution
    if evolution.variation != "neat" and evolution.inheritance != "none":
        raise ValueError(
            f"{holder} is bred by evolution.variation = 'neat', and not {evolution.variation!r}"
        )


def entries(links: int) -> int:
    """Entries of a genome with room for so many links."""
    return HEAD + GENE * links


def minimal(
    inputs: int, outputs: int, links: int, weights: npt.NDArray[Any]
) -> npt.NDArray[np.float32]:
    """Networks without hidden nodes, every input linked with every output: [agent, entry], from `weights` [agent, link]."""
    made = np.zeros((len(weights), entries(links)), np.float32)
    made[:, : inputs * outputs] = weights
    for graph in made:
        begin(graph, inputs, outputs)
    return made


@compiled
def begin(graph: Graph, inputs: int, outputs: int) -> None:
    """Make a network without hidden nodes, every input linked with every output, of the weights that `graph` begins with."""
    first, links = inputs + outputs, inputs * outputs
    for entry in range(HEAD + GENE * links, graph.size):
        graph[entry] = ZERO
    for link in range(
        links - 1, -1, -1
    ):  # from the last on, so that no weight is written over before it is read
        gene, weight = HEAD + GENE * link, graph[link]
        graph[gene + NUMBER], graph[gene + SOURCE], graph[gene + TARGET] = (
            first + link,
            link // outputs,
            inputs + link % outputs,
        )
        graph[gene + WEIGHT], graph[gene + ENABLED] = weight, ONE
    graph[INPUTS], graph[OUTPUTS], graph[LEDGER] = inputs, outputs, first + links - 1
    graph[NEWEST], graph[SPECIES], graph[STALE], graph[STALE_OF_ALL] = ONE, ONE, ZERO, ZERO
    graph[BEST] = graph[BEST_OF_ALL] = -np.inf


@compiled
def gene_at(link: int) -> int:
    """Where the gene of a link begins."""
    return HEAD + GENE * link


@compiled
def room(graph: Graph) -> int:
    """For how many links there is room."""
    return (graph.size - HEAD) // GENE


@compiled
def links_of(graph: Graph) -> int:
    """How many links there are, enabled or not."""
    links = 0
    while links < room(graph) and graph[gene_at(links) + NUMBER] > ZERO:
        links += 1
    return links


@compiled
def makes_a_node(graph: Graph, link: int) -> bool:
    """Whether a link is the one that its target, a hidden node, is named by."""
    return bool(graph[gene_at(link) + NUMBER] == graph[gene_at(link) + TARGET])


@compiled
def has_link(graph: Graph, source: Any, target: Any) -> bool:
    found = False
    for link in range(links_of(graph)):
        found = found or (
            graph[gene_at(link) + SOURCE] == source and graph[gene_at(link) + TARGET] == target
        )
    return found


@compiled
def nodes_of(graph: Graph) -> int:
    """How many nodes there are: inputs, outputs, and hidden ones."""
    nodes = int(graph[INPUTS]) + int(graph[OUTPUTS])
    for link in range(links_of(graph)):
        nodes += int(makes_a_node(graph, link))
    return nodes


@compiled
def node_of(graph: Graph, place: int) -> Any:
    """The name of the node at a place: inputs and outputs first, then the hidden ones, the oldest first."""
    fixed = int(graph[INPUTS]) + int(graph[OUTPUTS])
    name, hidden = np.float32(place), fixed
    for link in range(links_of(graph)):
        if makes_a_node(graph, link):
            if hidden == place:
                name = graph[gene_at(link) + TARGET]
            hidden += 1
    return name


@compiled
def leads_to(graph: Graph, source: Any, target: Any, marks: Any) -> bool:
    """Whether links, enabled or not, lead from one node to another, or they are the same. `marks` [link] is scratch."""
    links = links_of(graph)
    for link in range(links):
        marks[link] = 0.0
    found, grew = bool(source == target), True
    while grew and not found:
        grew = False
        for link in range(links):
            if marks[link] == 0.0 and _is_reached(graph, source, link, links, marks):
                marks[link], grew = 1.0, True
                found = found or graph[gene_at(link) + TARGET] == target
    return found


@compiled
def _is_reached(graph: Graph, source: Any, link: int, links: int, marks: Any) -> bool:
    """Whether a link begins at the source, or where one ends that is marked."""
    begin = graph[gene_at(link) + SOURCE]
    found = bool(begin == source)
    for other in range(links):
        found = found or (marks[other] > 0.0 and graph[gene_at(other) + TARGET] == begin)
    return found


@compiled
def answer(graph: Graph, inputs: int, outputs: int, steepness: Any, values: Any) -> None:
    """Fill `values` [unit], of which the inputs are given: each node as soon as all that it hears have answered; no loops.

    The rows are the inputs, without the bias; one for each link that there is room for, which is that of the hidden node
    that the link once made (0 where it made none); and the outputs. A node answers sigmoid(steepness x total).
    """
    first_output = values.size - outputs
    links = min(links_of(graph), first_output - inputs)
    for row in range(inputs, values.size):
        there = row >= first_output or (row - inputs < links and makes_a_node(graph, row - inputs))
        values[row] = UNKNOWN if there else ZERO
    more = True
    while more:
        more = False
        for row in range(inputs, values.size):
            if values[row] == UNKNOWN:
                heard, total = _total(graph, inputs, outputs, links, values, row)
                if heard:
                    values[row], more = sigmoid(steepness * total), True


@compiled
def _total(graph: Graph, inputs: int, outputs: int, links: int, values: Any, row: int) -> Any:
    """Whether all have answered that the node of a row hears, and what they come to, in the order of the links."""
    heard, total = True, ZERO
    for link in range(links):
        gene = gene_at(link)
        if (
            graph[gene + ENABLED] > ZERO
            and row_of(graph, inputs, outputs, links, graph[gene + TARGET], values.size) == row
        ):
            source = row_of(graph, inputs, outputs, links, graph[gene + SOURCE], values.size)
            value = ONE if source < 0 else values[source]
            heard = heard and (
                source < inputs or value != UNKNOWN
            )  # an input may be what no node answers
            total += graph[gene + WEIGHT] * value
    return heard, total


@compiled
def list_links(graph: Graph, inputs: int, outputs: int, units: int, found: Any) -> int:
    """Fill `found` [link, (from row, to row, weight)] with the links that are enabled, of which it says how many there are."""
    links, count = min(links_of(graph), units - inputs - outputs), 0
    for link in range(links):
        gene = gene_at(link)
        if graph[gene + ENABLED] > ZERO:
            found[count, 0] = row_of(graph, inputs, outputs, links, graph[gene + SOURCE], units)
            found[count, 1] = row_of(graph, inputs, outputs, links, graph[gene + TARGET], units)
            found[count, 2] = graph[gene + WEIGHT]
            count += 1
    return count


@compiled
def row_of(graph: Graph, inputs: int, outputs: int, links: int, name: Any, units: int) -> Any:
    """The row of the node of a name; -1 for the bias."""
    node = int(name)
    if node <= inputs:
        return node if node < inputs else -1
    if node <= inputs + outputs:
        return units - outputs + node - inputs - 1
    row = -1
    for link in range(links):
        if graph[gene_at(link)] == name:
            row = inputs + link
    return row
