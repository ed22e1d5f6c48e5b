"""Test NEAT networks of make_experiment: outputs, evolution and refused combinations."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from baldwinlab.evolution import GenerationKey
from baldwinlab.evolution.neat.genome import (
    HEAD_SIZE,
    activate,
    count_entries,
    count_links,
    count_nodes,
    defines_node,
)
from baldwinlab.experiment import Experiment, ExperimentError
from baldwinlab.papers.presets import load
from baldwinlab.parts.part import compiled_values
from baldwinlab.simulation.simulate import simulate_batch
from tests.evolution.single_runs import draw_genomes
from tests.oracles import neat as oracle

ALL_INPUTS = [[float(code >> k & 1) for k in range(3)] for code in range(8)]


def make_experiment(**changes: Any) -> Experiment:
    experiment: Experiment = load("evo/A", "neat")
    return experiment.replace(
        **({"lifetime": {"steps": 1000}, "evolution": {"generations": 30}} | changes)
    )


@pytest.fixture(scope="module")
def run() -> Any:
    fast = {"neat": {"add_node_rate": 0.2, "add_link_rate": 0.3}, "generations": 30}
    return simulate_batch(make_experiment(evolution=fast), seed=3, runs=[0])[0]


def evaluate(graph: npt.NDArray[np.float32], inputs: list[float]) -> npt.NDArray[np.float32]:
    """Return the activations of all units of a forager."""
    experiment = make_experiment()
    values = compiled_values(experiment.part("network.kind"), experiment, lambda array: None)
    units = np.zeros(sum(experiment.layer_sizes), np.float32)
    units[:3] = inputs
    activate(graph, values.inputs, values.outputs, values.sigmoid_slope, units)
    return units


def test_founders_have_links_from_each_input_and_the_bias_to_each_action() -> None:
    experiment = make_experiment()
    genome = draw_genomes(experiment, GenerationKey(0, 0, 0))
    assert {(count_links(graph), count_nodes(graph)) for graph in genome[:, 0]} == {(12, 7)}
    weights = genome[:, 0, HEAD_SIZE + 3 : count_entries(12) : 5]
    assert abs(weights.mean()) < 0.3 and 0.8 < weights.std() < 1.2, (
        "weights have the distribution N(0, 1)"
    )
    layers = draw_genomes(load("evo/A").replace(network={"hidden": [40]}), GenerationKey(0, 0, 0))
    assert weights.tolist() == layers[:, 0, :12].tolist(), "both use the first random numbers"


def test_outputs_agree_with_the_plain_python_oracle(run: Any) -> None:
    graphs_with_new_nodes = 0
    for graph in run["genome"].values[-1][:, 0]:
        graphs_with_new_nodes += count_nodes(graph) > 7
        for inputs in ALL_INPUTS:
            expected = oracle.activate(graph[: count_entries(40)].tolist(), 4.9, [*inputs, 1.0])
            assert evaluate(graph, inputs)[-3:] == pytest.approx(expected, abs=2e-5)
    assert graphs_with_new_nodes > 10


def test_the_row_of_a_hidden_node_is_the_row_of_the_link_that_defines_it(run: Any) -> None:
    graph = max(run["genome"].values[-1][:, 0], key=count_nodes)
    units = evaluate(graph, [1.0, 0.0, 1.0])
    hidden = [link for link in range(count_links(graph)) if defines_node(graph, link)]
    assert np.flatnonzero(units[3:-3]).tolist() == hidden
    assert ((units[3:-3] == 0) | ((units[3:-3] > 0) & (units[3:-3] < 1))).all()


def test_evolved_networks_are_larger_and_eat_more_than_founders(run: Any) -> None:
    genome = run["genome"].values[:, :, 0]
    eaten = run["food_eaten"].mean("agent").values
    assert max(count_nodes(graph) for graph in genome[-1]) > 8
    assert eaten[-10:].mean() > 2 * eaten[0]


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        (
            {"learning": {"rule": "self-taught"}},
            "does not learn: learning.rule = 'self-taught' must be 'none'",
        ),
        (
            {"evolution": {"variation": "gaussian"}},
            "is bred by evolution.variation = 'neat', and not 'gaussian'",
        ),
        ({"network": {"biases": True}}, "has its bias as a node: network.biases must be false"),
        ({"network": {"hidden": [10]}}, "starts with 12 links, but can hold only 10"),
        ({"network": {"hidden": [40, 40]}}, "network.hidden must be one number"),
    ],
)
def test_an_unsupported_combination_is_refused_in_a_sentence(
    changes: dict[str, Any], sentence: str
) -> None:
    with pytest.raises(ExperimentError, match=re.escape(sentence)):
        make_experiment(**changes)
