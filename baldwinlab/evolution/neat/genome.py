"""Format of genomes that are graphs: networks of any topology, with a gene for each link.

A genome is a float32 array [entry]: a head of `HEAD_SIZE` entries and a gene of `GENE_SIZE` entries
for each link. Genes are in the order of their innovation numbers (historical marks). An innovation
number of 0 ends the list. Nodes have whole numbers: the inputs from 0 on, the bias as the last
input, then the outputs. The number of a hidden node is the innovation number of the first link to
this node. Therefore, the nodes of a genome follow from the links, without a list of nodes. The
array format is ours.

References
----------
K. O. Stanley and R. Miikkulainen, "Evolving neural networks through augmenting topologies",
Evolutionary Computation 10 (2002), sections 3.1 and 3.2.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import numpy.typing as npt

from baldwinlab.engine.arithmetic import sigmoid
from baldwinlab.engine.jit import compiled
from baldwinlab.engine.simd import ONE, ZERO
from baldwinlab.parts import Field

# Entries of the head. All genomes of a run share the numbers of inputs and outputs, and the last
# innovation and species numbers. The other entries are the species of the genome, and the status of
# the species and of the population: best fitness, and generations without improvement.
(
    INPUTS,
    OUTPUTS,
    LAST_INNOVATION,
    LAST_SPECIES,
    SPECIES,
    BEST,
    STALE,
    POPULATION_BEST,
    POPULATION_STALE,
) = range(9)
HEAD_SIZE: Final = 9
# Entries that are minus infinity before a species is evaluated.
INFINITE_GENES: Final = (BEST, POPULATION_BEST)
# Entries of a gene.
INNOVATION, SOURCE, TARGET, WEIGHT, ENABLED = range(5)
GENE_SIZE: Final = 5

# [entry].
Graph = npt.NDArray[np.float32]
SIGMOID_SLOPE: Any = Field(
    4.9,
    gt=0,
    le=1000,
    description="Slope of the sigmoid: output = 1 / (1 + exp(-sigmoid_slope * input)).",
)
"""Setting of the parts that compute the values of nodes."""
# Value of a node before its update. The sigmoid never has this value.
NOT_COMPUTED = np.float32(-1)


def require_neat(experiment: Any, subject: str) -> None:
    """Raise ValueError if the variation is not `neat`, because other variations destroy graphs.

    `subject` is the setting that needs graphs, for the message.
    """
    evolution = experiment.evolution
    if evolution.variation != "neat" and evolution.inheritance != "none":
        raise ValueError(
            f"{subject} is bred by evolution.variation = 'neat', and not {evolution.variation!r}"
        )


def count_entries(max_links: int) -> int:
    """Return the number of entries of a genome that can store `max_links` links."""
    return HEAD_SIZE + GENE_SIZE * max_links


def make_minimal_graphs(
    inputs: int, outputs: int, max_links: int, weights: npt.NDArray[Any]
) -> npt.NDArray[np.float32]:
    """Return networks [agent, entry] with `weights` [agent, link] from all inputs to outputs."""
    graphs = np.zeros((len(weights), count_entries(max_links)), np.float32)
    # `init_minimal_graph` moves the weights from the first entries into the genes.
    graphs[:, : inputs * outputs] = weights
    for graph in graphs:
        init_minimal_graph(graph, inputs, outputs)
    return graphs


@compiled
def init_minimal_graph(graph: Graph, inputs: int, outputs: int) -> None:
    """Write a network without hidden nodes, with all links from inputs to outputs.

    The weights are read from the first entries of `graph`.
    """
    first = inputs + outputs
    links = inputs * outputs
    for entry in range(HEAD_SIZE + GENE_SIZE * links, graph.size):
        graph[entry] = ZERO
    # The genes overwrite the weights. The reverse order reads each weight before.
    for link in range(links - 1, -1, -1):
        gene = HEAD_SIZE + GENE_SIZE * link
        weight = graph[link]
        graph[gene + INNOVATION] = first + link
        graph[gene + SOURCE] = link // outputs
        graph[gene + TARGET] = inputs + link % outputs
        graph[gene + WEIGHT] = weight
        graph[gene + ENABLED] = ONE
    graph[INPUTS] = inputs
    graph[OUTPUTS] = outputs
    graph[LAST_INNOVATION] = first + links - 1
    graph[LAST_SPECIES] = ONE
    graph[SPECIES] = ONE
    graph[STALE] = ZERO
    graph[POPULATION_STALE] = ZERO
    graph[BEST] = graph[POPULATION_BEST] = -np.inf


@compiled
def gene_offset(link: int) -> int:
    """Return the first entry of the gene of a link."""
    return HEAD_SIZE + GENE_SIZE * link


@compiled
def link_capacity(graph: Graph) -> int:
    """Return the maximum number of links."""
    return (graph.size - HEAD_SIZE) // GENE_SIZE


@compiled
def count_links(graph: Graph) -> int:
    """Return the number of links, enabled or disabled."""
    links = 0
    while links < link_capacity(graph) and graph[gene_offset(links) + INNOVATION] > ZERO:
        links += 1
    return links


@compiled
def defines_node(graph: Graph, link: int) -> bool:
    """Return whether the target of a link is the hidden node with the number of the link."""
    return bool(graph[gene_offset(link) + INNOVATION] == graph[gene_offset(link) + TARGET])


@compiled
def link_number(graph: Graph, source: Any, target: Any) -> Any:
    """Return the number of the link from `source` to `target`, enabled or disabled, or 0."""
    number = ZERO
    for link in range(count_links(graph)):
        if (
            graph[gene_offset(link) + SOURCE] == source
            and graph[gene_offset(link) + TARGET] == target
        ):
            number = graph[gene_offset(link) + INNOVATION]
    return number


@compiled
def count_nodes(graph: Graph) -> int:
    """Return the number of nodes: inputs, outputs and hidden nodes."""
    nodes = int(graph[INPUTS]) + int(graph[OUTPUTS])
    for link in range(count_links(graph)):
        nodes += int(defines_node(graph, link))
    return nodes


@compiled
def node_number(graph: Graph, index: int) -> Any:
    """Return the number of node `index`: inputs first, outputs, then hidden nodes, oldest first."""
    fixed = int(graph[INPUTS]) + int(graph[OUTPUTS])
    number = np.float32(index)
    hidden = fixed
    for link in range(count_links(graph)):
        if defines_node(graph, link):
            if hidden == index:
                number = graph[gene_offset(link) + TARGET]
            hidden += 1
    return number


@compiled
def has_path(graph: Graph, source: Any, target: Any, marks: Any) -> bool:
    """Return whether links lead from `source` to `target`, or the two are the same node.

    Disabled links count, too. `marks` [link] is scratch: 1 for a link on a path from `source`.
    """
    links = count_links(graph)
    for link in range(links):
        marks[link] = 0.0
    reached = bool(source == target)
    has_changed = True
    while has_changed and not reached:
        has_changed = False
        for link in range(links):
            if marks[link] == 0.0 and _is_reached(graph, source, link, links, marks):
                marks[link] = 1.0
                has_changed = True
                reached = reached or graph[gene_offset(link) + TARGET] == target
    return reached


@compiled
def _is_reached(graph: Graph, source: Any, link: int, links: int, marks: Any) -> bool:
    """Return whether the source of a link is `source` or the target of a marked link."""
    link_source = graph[gene_offset(link) + SOURCE]
    reached = bool(link_source == source)
    for incoming_link in range(links):
        is_marked = marks[incoming_link] > 0.0
        leads_to_source = graph[gene_offset(incoming_link) + TARGET] == link_source
        reached = reached or (is_marked and leads_to_source)
    return reached


@compiled
def activate(graph: Graph, inputs: int, outputs: int, steepness: Any, values: Any) -> None:
    """Compute the values of all nodes of a network without loops.

    The value of a node is sigmoid(steepness * total), where `total` is the weighted input.

    - `inputs`: number of inputs without the bias.
    - `values` [row]: input and output. The first rows are the inputs, with values. The last rows
      are the outputs. Between them is a row for each possible link, with the value of the hidden
      node that has the number of the link. Without such a node, the value is 0.
    """
    first_output = values.size - outputs
    links = min(count_links(graph), first_output - inputs)
    for row in range(inputs, values.size):
        link = row - inputs
        is_hidden_node = link < links and defines_node(graph, link)
        is_node = row >= first_output or is_hidden_node
        values[row] = NOT_COMPUTED if is_node else ZERO
    has_changed = True
    while has_changed:
        has_changed = False
        for row in range(inputs, values.size):
            if values[row] == NOT_COMPUTED:
                is_complete, total = _sum_inputs(graph, inputs, outputs, links, values, row)
                if is_complete:
                    values[row] = sigmoid(steepness * total)
                    has_changed = True


@compiled
def _sum_inputs(graph: Graph, inputs: int, outputs: int, links: int, values: Any, row: int) -> Any:
    """Return (whether all sources of a node have values, weighted sum of the sources).

    The terms are added in the order of the links.
    """
    is_complete = True
    total = ZERO
    for link in range(links):
        gene = gene_offset(link)
        if (
            graph[gene + ENABLED] > ZERO
            and node_row(graph, inputs, outputs, links, graph[gene + TARGET], values.size) == row
        ):
            source = node_row(graph, inputs, outputs, links, graph[gene + SOURCE], values.size)
            value = ONE if source < 0 else values[source]
            # An input always has a value, which may be equal to NOT_COMPUTED.
            has_value = source < inputs or value != NOT_COMPUTED
            is_complete = is_complete and has_value
            total += graph[gene + WEIGHT] * value
    return is_complete, total


@compiled
def list_links(graph: Graph, inputs: int, outputs: int, units: int, listed: Any) -> int:
    """Write (source row, target row, weight) of enabled links to `listed`. Return the number."""
    links = min(count_links(graph), units - inputs - outputs)
    count = 0
    for link in range(links):
        gene = gene_offset(link)
        if graph[gene + ENABLED] > ZERO:
            listed[count, 0] = node_row(graph, inputs, outputs, links, graph[gene + SOURCE], units)
            listed[count, 1] = node_row(graph, inputs, outputs, links, graph[gene + TARGET], units)
            listed[count, 2] = graph[gene + WEIGHT]
            count += 1
    return count


@compiled
def node_row(graph: Graph, inputs: int, outputs: int, links: int, number: Any, units: int) -> Any:
    """Return the row in `values` of the node with a number, or -1 for the bias."""
    node = int(number)
    # The number of the bias is `inputs`.
    if node <= inputs:
        return node if node < inputs else -1
    if node <= inputs + outputs:
        return units - outputs + node - inputs - 1
    row = -1
    for link in range(links):
        if graph[gene_offset(link) + INNOVATION] == number:
            row = inputs + link
    return row
