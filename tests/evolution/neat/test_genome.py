"""Genomes that are graphs: what is written into them can be read again, and answers like the network that it says it is."""

from __future__ import annotations

import numpy as np
import pytest

from baldwinlab.evolution.neat import oracle
from baldwinlab.evolution.neat.genome import (
    activate,
    count_links,
    count_nodes,
    has_path,
    link_capacity,
    node_number,
    node_row,
)
from baldwinlab.experiment import ExperimentError
from baldwinlab.papers.presets import load
from tests.evolution.neat.grown import ROOM, evolved, first_network, genes, network

NESTED = network(
    (4, 0, 3, 0.5, 0), (5, 1, 3, -1.0, 1), (6, 2, 3, 0.25, 1), (9, 0, 9, 1.0, 1), (10, 9, 3, 0.5, 1)
)


def answers(graph: np.ndarray, inputs: list[float], steepness: float = 4.9) -> float:
    units = np.zeros(2 + link_capacity(graph) + 1, np.float32)
    units[:2] = inputs
    activate(graph, 2, 1, np.float32(steepness), units)
    return float(units[-1])


def test_a_first_network_links_every_input_with_the_output() -> None:
    graph = first_network()
    assert (count_links(graph), count_nodes(graph)) == (3, 4)
    expected = {4: [0, 3, 0.1, 1], 5: [1, 3, 0.2, 1], 6: [2, 3, 0.3, 1]}
    assert {number: pytest.approx(gene) for number, gene in expected.items()} == genes(graph)


def test_a_hidden_node_has_the_number_of_the_link_that_led_to_it() -> None:
    assert count_nodes(NESTED) == 5
    assert [node_number(NESTED, place) for place in range(5)] == [0, 1, 2, 3, 9]
    rows = [
        node_row(NESTED, 2, 1, count_links(NESTED), np.float32(node), 2 + ROOM + 1)
        for node in (0, 1, 2, 3, 9)
    ]
    assert rows == [0, 1, -1, 2 + ROOM, 2 + 3], (
        "inputs, the bias, the output, and the hidden node of the fourth link"
    )


def test_links_lead_on_whether_enabled_or_not() -> None:
    marks = np.zeros(ROOM)
    lead = {
        (a, b): has_path(NESTED, np.float32(a), np.float32(b), marks)
        for a in (0, 1, 9, 3)
        for b in (0, 9, 3)
    }
    assert [pair for pair, leads in lead.items() if leads] == [
        (0, 0),
        (0, 9),
        (0, 3),
        (1, 3),
        (9, 9),
        (9, 3),
        (3, 3),
    ]


def test_a_network_without_hidden_nodes_is_one_logistic_unit() -> None:
    total = 0.1 * -1 + 0.2 * 0.5 + 0.3
    assert answers(first_network(), [-1, 0.5], 2.0) == pytest.approx(
        1 / (1 + np.exp(-2 * total)), abs=1e-6
    )


def test_a_disabled_link_says_nothing_and_a_hidden_node_speaks_in_its_place() -> None:
    hidden = 1 / (1 + np.exp(-4.9))
    expected = 1 / (1 + np.exp(-4.9 * (0.5 * hidden - 1.0 + 0.25)))
    assert answers(NESTED, [1, 1]) == pytest.approx(expected, abs=1e-6)


def test_grown_networks_answer_as_plain_python_does() -> None:
    for graph in evolved(25)[:, 0]:
        for inputs in ([0.0, 0.0], [1.0, 0.0], [0.3, -0.7]):
            assert answers(graph, inputs) == pytest.approx(
                oracle.activate(graph.tolist(), 4.9, [*inputs, 1.0])[0], abs=2e-5
            )


def test_however_they_grow_networks_are_in_order_and_without_loops() -> None:
    for graph in evolved(40)[:, 0]:
        found = genes(graph)
        assert list(found) == sorted(found)
        pairs = [(source, target) for source, target, *_ in found.values()]
        assert len(set(pairs)) == len(pairs), "no two links join the same nodes"
        hidden = {number for number, gene in found.items() if gene[1] == number}
        assert {node for pair in pairs for node in pair} <= {0, 1, 2, 3} | hidden
        assert not {target for _, target in pairs} & {0, 1, 2}
        behind = {0.0, 1.0, 2.0}
        for _ in pairs:
            behind |= {
                node for node in hidden | {3} if {a for a, b in pairs if b == node} <= behind
            }
        assert behind == {0, 1, 2, 3} | hidden, (
            "nodes can be put in an order in which every link leads on"
        )


@pytest.mark.parametrize("model", ["neat-xor", "neat-poles", "neat-poles-without-velocities"])
def test_another_variation_would_make_no_graphs_and_is_refused(model: str) -> None:
    with pytest.raises(
        ExperimentError,
        match=f"model = '{model}' is bred by evolution.variation = 'neat', and not 'bit-flips'",
    ):
        load(model).replace(evolution={"variation": "bit-flips"})
