"""Genomes that encode graphs: reading of genes, paths, and the output of the networks."""

from __future__ import annotations

import numpy as np
import pytest

from baldwinlab.evolution.neat.genome import (
    activate,
    count_links,
    count_nodes,
    has_path,
    link_capacity,
    node_number,
    node_row,
)
from tests.evolution.neat.grown import LINK_CAPACITY, evolved, first_network, genes_of, make_network
from tests.oracles import neat as oracle

NETWORK = make_network(
    (4, 0, 3, 0.5, 0), (5, 1, 3, -1.0, 1), (6, 2, 3, 0.25, 1), (9, 0, 9, 1.0, 1), (10, 9, 3, 0.5, 1)
)


def compute_output(graph: np.ndarray, inputs: list[float], steepness: float = 4.9) -> float:
    units = np.zeros(2 + link_capacity(graph) + 1, np.float32)
    units[:2] = inputs
    activate(graph, 2, 1, np.float32(steepness), units)
    return float(units[-1])


def test_a_founder_links_every_input_with_the_output() -> None:
    graph = first_network()
    assert (count_links(graph), count_nodes(graph)) == (3, 4)
    expected = {4: [0, 3, 0.1, 1], 5: [1, 3, 0.2, 1], 6: [2, 3, 0.3, 1]}
    assert {number: pytest.approx(gene) for number, gene in expected.items()} == genes_of(graph)


def test_a_hidden_node_has_the_number_of_its_first_incoming_link() -> None:
    assert count_nodes(NETWORK) == 5
    assert [node_number(NETWORK, index) for index in range(5)] == [0, 1, 2, 3, 9]
    rows = [
        node_row(NETWORK, 2, 1, count_links(NETWORK), np.float32(node), 2 + LINK_CAPACITY + 1)
        for node in (0, 1, 2, 3, 9)
    ]
    # Two inputs, the bias, the output, and the hidden node of the fourth link.
    assert rows == [0, 1, -1, 2 + LINK_CAPACITY, 2 + 3]


def test_paths_include_disabled_links() -> None:
    buffer = np.zeros(LINK_CAPACITY)
    has_path_by_pair = {
        (a, b): has_path(NETWORK, np.float32(a), np.float32(b), buffer)
        for a in (0, 1, 9, 3)
        for b in (0, 9, 3)
    }
    assert [pair for pair, connected in has_path_by_pair.items() if connected] == [
        (0, 0),
        (0, 9),
        (0, 3),
        (1, 3),
        (9, 9),
        (9, 3),
        (3, 3),
    ]


def test_the_output_of_grown_networks_equals_the_oracle() -> None:
    for graph in evolved(25)[:, 0]:
        for inputs in ([0.0, 0.0], [1.0, 0.0], [0.3, -0.7]):
            assert compute_output(graph, inputs) == pytest.approx(
                oracle.activate(graph.tolist(), 4.9, [*inputs, 1.0])[0], abs=2e-5
            )


def test_grown_networks_have_sorted_genes_and_no_cycles() -> None:
    for graph in evolved(40)[:, 0]:
        genes = genes_of(graph)
        assert list(genes) == sorted(genes)
        pairs = [(source, target) for source, target, *_ in genes.values()]
        assert len(set(pairs)) == len(pairs), "no two links join the same nodes"
        hidden = {number for number, gene in genes.items() if gene[1] == number}
        assert {node for pair in pairs for node in pair} <= {0, 1, 2, 3} | hidden
        assert not {target for _, target in pairs} & {0, 1, 2}
        ordered_nodes = {0.0, 1.0, 2.0}
        for _ in pairs:
            ordered_nodes |= {
                node for node in hidden | {3} if {a for a, b in pairs if b == node} <= ordered_nodes
            }
        assert ordered_nodes == {0, 1, 2, 3} | hidden, "the graph has a topological order"
