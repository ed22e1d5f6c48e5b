"""Foragers whose networks grow: the network kind `growing`, bred by the variation `neat`, best with the selection `species`.

The genome is a graph (see `graphs.py`), and it stands where the weights of a layered network would: `network.hidden = [40]` gives
it room for forty links, as far as so many entries hold them. The rows of units are the inputs, one for each link that there is
room for, which is that of the hidden node that the link once made (0 where it made none), and the outputs.

Source: Stanley and Miikkulainen 2002, section 3; that a node answers when all that it hears have answered is ours.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from baldwinlab.engine.arithmetic import sigmoid
from baldwinlab.engine.jit import compiled
from baldwinlab.engine.lanes import Lane, first_lane, lanes_of
from baldwinlab.library.neat import oracle
from baldwinlab.library.neat.graphs import (
    ENABLED,
    ONE,
    SOURCE,
    TARGET,
    WEIGHT,
    ZERO,
    Graph,
    entries,
    gene_at,
    links_of,
    makes_a_node,
)
from baldwinlab.parts import Field, Network
from baldwinlab.parts.kinds import compiled_values

UNKNOWN = np.float32(-1)  # what no node answers


def links_with_room(weights: int, hidden: int) -> int:
    """For how many links there is room in so many entries, with a row of units for each."""
    return max(0, min(hidden, (weights - entries(0)) // (entries(1) - entries(0))))


def _room(experiment: Any) -> int:
    return links_with_room(experiment.weight_count, sum(experiment.network.hidden))


class Growing(Network, name="growing"):
    """A network without loops whose nodes and links evolve (NEAT). It does not learn in life."""

    graphs: ClassVar[bool] = True
    needs: ClassVar[Mapping[str, Any]] = {
        "network.hidden": [40],
        "learning.rule": "none",
        "evolution.variation": "neat",
        "evolution.selection": "species",
    }
    steepness: float = Field(4.9, gt=0, le=1000, description="a node answers 1 / (1 + exp(-steepness x total))")

    derived: ClassVar[Mapping[str, Any]] = {
        "inputs": lambda part, experiment: len(experiment.inputs),
        "outputs": lambda part, experiment: len(experiment.actions),
        "room": lambda part, experiment: _room(experiment),
    }

    def check(self, experiment: Any) -> None:
        network, evolution = experiment.network, experiment.evolution
        if experiment.learning.rule != "none":
            raise ValueError(
                f"network.kind = 'growing' does not learn: learning.rule = {experiment.learning.rule!r} must be 'none'"
            )
        if evolution.variation != "neat" and evolution.inheritance != "none":
            raise ValueError(f"network.kind = 'growing' is bred by evolution.variation = 'neat', and not {evolution.variation!r}")
        if network.biases:
            raise ValueError("network.kind = 'growing' has its bias as a node: network.biases must be false")
        needed = (len(experiment.inputs) + 1) * len(experiment.actions)
        if len(network.hidden) != 1 or _room(experiment) < needed:
            raise ValueError(
                f"network.kind = 'growing' begins with {needed} links, and there is room for {_room(experiment)}: "
                "network.hidden must be one number, the links that there shall be room for, such as [40]"
            )

    def links(self, experiment: Any, weights: Any) -> list[tuple[int, int, float]]:
        part, units = compiled_values(self, experiment, lambda array: None), sum(experiment.layer_sizes)
        count = min(links_of(weights), part.room)
        genes = [weights[gene_at(link) : gene_at(link + 1)] for link in range(count)]
        ends = [[row_of(part, weights, count, gene[end], units) for end in (SOURCE, TARGET)] for gene in genes]
        return [(*pair, float(gene[WEIGHT])) for pair, gene in zip(ends, genes, strict=True) if gene[ENABLED] > ZERO]

    @staticmethod
    def forward(part: Any, weights: Any, activations: Any, lane: Lane) -> None:
        for one in range(first_lane(lane), first_lane(lane) + lanes_of(lane)):
            answer(part, weights[:, one], activations[:, one])

    @staticmethod
    def oracle(part: Any, agent: Any, naive: Any) -> Any:
        graph = [float(entry) for entry in naive.weights(agent.action_module)][: entries(int(part.room))]
        return oracle.activate(graph, float(part.steepness), [*agent.inputs, 1.0])


@compiled
def answer(part: Any, graph: Graph, values: Any) -> None:
    """Fill `values` [unit], of which the inputs are given: each node as soon as all that it hears have answered."""
    first_output = values.size - part.outputs
    links = min(links_of(graph), part.room)
    for row in range(part.inputs, values.size):
        there = row >= first_output or (row - part.inputs < links and makes_a_node(graph, row - part.inputs))
        values[row] = UNKNOWN if there else ZERO
    more = True
    while more:
        more = False
        for row in range(part.inputs, values.size):
            if values[row] == UNKNOWN:
                heard, total = _total(part, graph, links, values, row)
                if heard:
                    values[row], more = sigmoid(part.steepness * total), True


@compiled
def _total(part: Any, graph: Graph, links: int, values: Any, row: int) -> Any:
    """Whether all have answered that the node of a row hears, and what they come to, in the order of the links."""
    heard, total = True, ZERO
    for link in range(links):
        gene = gene_at(link)
        if graph[gene + ENABLED] > ZERO and row_of(part, graph, links, graph[gene + TARGET], values.size) == row:
            source = row_of(part, graph, links, graph[gene + SOURCE], values.size)
            value = ONE if source < 0 else values[source]
            heard = heard and value != UNKNOWN
            total += graph[gene + WEIGHT] * value
    return heard, total


@compiled
def row_of(part: Any, graph: Graph, links: int, name: Any, units: int) -> Any:
    """The row of the node of a name; -1 for the bias."""
    node = int(name)
    if node <= part.inputs:
        return node if node < part.inputs else -1
    if node <= part.inputs + part.outputs:
        return units - part.outputs + node - part.inputs - 1
    row = -1
    for link in range(links):
        if graph[gene_at(link)] == name:
            row = part.inputs + link
    return row
