"""Test recurrent networks against feed-forward networks, oracles and known dynamics."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.optimize import brentq

from baldwinlab.api.checks.reference import Naive
from baldwinlab.experiment import Experiment, ExperimentError
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from baldwinlab.models.miniworld.networks.feed_forward import Rows
from baldwinlab.papers.presets import load
from baldwinlab.parts.networks import Training
from baldwinlab.parts.part import compiled_values
from baldwinlab.simulation.replay import replay
from baldwinlab.simulation.simulate import simulate
from tests.oracles.parts import find_oracle
from tests.worlds import make_small_experiment

INPUTS = 3
ACTIONS = 3
NAMES = ["simple-recurrent", "continuous-time"]


class Net:
    """Network of one agent in plain Python. All units of a newborn are 0."""

    def __init__(
        self,
        kind: str,
        hidden: Sequence[int],
        weights: Any = None,
        biases: bool = False,
        **fields: Any,
    ) -> None:
        table = {kind.replace("-", "_"): fields} if fields else {}
        self.experiment: Experiment = load("evo/A").replace(
            network={"kind": kind, "hidden": list(hidden), "biases": biases, **table}
        )
        self.part: Any = self.experiment.part("network.kind")
        self.values = compiled_values(self.part, self.experiment, lambda array: None)
        values = np.zeros(self.experiment.weight_count) if weights is None else np.asarray(weights)
        self.weights: Rows = values.astype(np.float32).reshape(-1, 1).copy()
        self.units: Rows = np.zeros((sum(self.experiment.layer_sizes), 1), np.float32)

    def layer(self, number: int) -> npt.NDArray[np.float32]:
        """Return a view of the weights of a layer, [from, to]."""
        bias = int(self.experiment.network.biases)
        sizes = self.experiment.layer_sizes
        counts = [(a + bias) * b for a, b in pairwise(sizes)]
        first = sum(counts[:number])
        return self.weights[first : first + counts[number], 0].reshape(-1, sizes[number + 1])

    def step(self, *inputs: float) -> npt.NDArray[np.float32]:
        """Return the outputs to the inputs of a time step."""
        self.units[:INPUTS, 0] = inputs
        self.part.forward(self.values, self.weights, self.units, 0)
        return self.units[-ACTIONS:, 0].copy()

    def learn(self, rate: float, target: Sequence[float]) -> None:
        targets = np.array(target, np.float32).reshape(-1, 1)
        errors = np.zeros_like(self.units)
        training = Training(np.float32(rate), self.weights, self.units, errors, targets)
        self.part.backward(self.values, training, 0)


def draw_inputs(steps: int, seed: int = 1) -> npt.NDArray[np.int64]:
    return np.random.default_rng(seed).integers(0, 2, (steps, INPUTS))


def make_random_net(kind: str, hidden: Sequence[int], biases: bool, **fields: Any) -> Net:
    net = Net(kind, hidden, biases=biases, **fields)
    net.weights[:, 0] = np.random.default_rng(5).normal(size=len(net.weights))
    return net


def remove_memory(net: Net, hidden: Sequence[int], biases: bool) -> Net:
    """Set the weights of memory units to 0, and return the equal feed-forward network."""
    context = np.arange(INPUTS, INPUTS + hidden[0])
    net.layer(0)[context] = 0
    from_inputs = np.delete(net.layer(0), context, axis=0)
    other_layers = net.weights[net.layer(0).size :, 0]
    return Net("feed-forward", hidden, np.concatenate([from_inputs.ravel(), other_layers]), biases)


@pytest.mark.parametrize("biases", [False, True])
@pytest.mark.parametrize(
    ("kind", "hidden"),
    [("simple-recurrent", [4]), ("simple-recurrent", [4, 2]), ("continuous-time", [4])],
)
def test_a_network_with_memory_weights_of_0_is_bit_identical_to_a_feed_forward_network(
    kind: str, hidden: list[int], biases: bool
) -> None:
    fields = {"time_constant": 1.0} if kind == "continuous-time" else {}
    net = make_random_net(kind, hidden, biases, **fields)
    plain = remove_memory(net, hidden, biases)
    for inputs in draw_inputs(30):
        assert net.step(*inputs).tobytes() == plain.step(*inputs).tobytes()


def test_a_simple_recurrent_network_follows_the_gradient_with_a_constant_memory() -> None:
    net = make_random_net("simple-recurrent", [3], True)
    target = [0.9, 0.2, 0.6]
    rate = 0.5
    step_size = 1e-6
    for inputs in draw_inputs(4):
        net.step(*inputs)
    before = net.weights[:, 0].astype(float)
    sources = net.units[: INPUTS + 3, 0].astype(float)
    assert (sources[INPUTS:] > 0).all(), "the memory is not empty"
    naive = Naive(net.experiment.layer_sizes, True, 1, 1, 1, 0)

    def half_squared_error(weights: npt.NDArray[np.float64]) -> float:
        outputs = naive.think(naive.module(weights.tolist()), sources.tolist())
        return sum((output - goal) ** 2 for output, goal in zip(outputs, target, strict=True)) / 2

    net.learn(rate, target)
    for index, change in enumerate(net.weights[:, 0] - before):
        step = step_size * np.eye(before.size)[index]
        difference = half_squared_error(before + step) - half_squared_error(before - step)
        assert change == pytest.approx(-rate * difference / (2 * step_size), abs=1e-6)


def make_single_unit(
    time_constant: float, bias: float = 0.0, to_itself: float = 0.0, from_input: float = 0.0
) -> Net:
    """Return a continuous-time network with a single hidden unit."""
    net = Net("continuous-time", [1], biases=True, time_constant=time_constant)
    net.layer(0)[:, 0] = [from_input, 0, 0, to_itself, bias]
    return net


def unit_state(net: Net) -> float:
    return float(net.units[INPUTS, 0])


def test_a_unit_with_only_an_input_charges_and_discharges_like_a_capacitor() -> None:
    net = make_single_unit(5.0, from_input=2.0)
    for step in range(1, 31):
        net.step(1, 0, 0)
        assert unit_state(net) == pytest.approx(2 * (1 - 0.8**step), abs=1e-5)
    charged = unit_state(net)
    for step in range(1, 31):
        net.step(0, 0, 0)
        assert unit_state(net) == pytest.approx(charged * 0.8**step, abs=1e-5)


@pytest.mark.parametrize("time_constant", [2.0, 4.0, 20.0])
@pytest.mark.parametrize(
    ("to_itself", "bias", "drive"),
    [(3.0, -1.0, 0.5), (-6.0, 2.0, 1.0), (0.0, 1.0, -2.0), (3.9, 0.0, -2.0)],
)
def test_a_unit_converges_to_its_fixed_point_for_every_time_constant(
    to_itself: float, bias: float, drive: float, time_constant: float
) -> None:
    net = make_single_unit(time_constant, bias, to_itself, drive)
    for _ in range(60 * int(time_constant) + 300):
        net.step(1, 0, 0)
    fixed_point = brentq(lambda y: to_itself / (1 + math.exp(-y - bias)) + drive - y, -20, 20)
    assert unit_state(net) == pytest.approx(fixed_point, abs=1e-4)


@pytest.mark.parametrize("biases", [False, True])
def test_a_continuous_time_network_agrees_with_its_oracle(biases: bool) -> None:
    net = make_random_net("continuous-time", [5], biases, time_constant=3.0)
    naive = Naive(net.experiment.layer_sizes, biases, 1, 1, 1, 0)
    module = naive.module(net.weights[:, 0].tolist())
    agent = SimpleNamespace(action_module=module, arrays={})
    for inputs in draw_inputs(60):
        agent.inputs = inputs.tolist()
        expected = find_oracle(net.part)(net.values, agent, naive)
        np.testing.assert_allclose(net.step(*inputs), expected, atol=1e-5)


@pytest.mark.parametrize("biases", [False, True])
def test_only_output_weights_of_a_continuous_time_network_learn(biases: bool) -> None:
    net = make_random_net("continuous-time", [4], biases)
    target = np.array([0.9, 0.1, 0.5])
    for inputs in draw_inputs(5):
        net.step(*inputs)
    units = net.units[:, 0].copy()
    first_before = net.layer(0).copy()
    second_before = net.layer(1).copy()
    net.learn(0.5, target.tolist())
    assert (net.layer(0) == first_before).all()
    y = units[-ACTIONS:].astype(float)
    hidden = np.append(units[INPUTS + 4 : INPUTS + 8], [1.0] * biases)
    expected = second_before - 0.5 * np.outer(hidden, (y - target) * y * (1 - y))
    np.testing.assert_allclose(net.layer(1), expected, atol=1e-6)


def test_a_network_with_unsupported_hidden_layers_is_refused() -> None:
    with pytest.raises(ExperimentError, match=r"network\.hidden must have at least one layer"):
        load("evo/A").replace(network={"kind": "simple-recurrent", "hidden": []})
    for hidden in ([], [3, 3]):
        with pytest.raises(ExperimentError, match=r"network\.hidden must have one entry"):
            load("evo/A").replace(network={"kind": "continuous-time", "hidden": hidden})


def test_the_compiled_network_is_bit_identical_to_plain_python_in_a_world_without_food() -> None:
    experiment = make_small_experiment(
        "evo", network={"kind": "continuous-time"}, world={"food": []}, lifetime={"steps": 12}
    )
    trace = replay(experiment, seed=1)
    assert not trace.sensor.any()
    for agent in range(2):
        net = Net(
            "continuous-time", experiment.network.hidden, trace.weight_birth.values[agent].ravel()
        )
        expected = np.stack([net.step(0, 0, 0) for _ in range(12)])
        assert trace.output.values[:, agent].astype(np.float32).tobytes() == expected.tobytes()


@pytest.mark.parametrize("kind", NAMES)
def test_a_newborn_with_the_drift_control_has_an_empty_memory_in_every_generation(
    kind: str, in_plain_python: None
) -> None:
    """The arrays hold values of the previous generation, which newborns must not read."""
    experiment = make_small_experiment(
        "evo+self-taught",
        learning={"control": "drift", "rate": 0.5},
        network={"kind": kind},
        lifetime={"steps": 9},
    )
    run = simulate(experiment, seed=2)
    weights = replay(experiment, seed=2, generation=2)["weight_death"].values
    batch = CpuBatch(experiment, 2, [0])
    for generation in range(3):
        batch.begin(generation, run["genome"].values[generation][None])
        batch.simulate(0, 9)
    np.testing.assert_array_equal(batch.weights()[0], weights[:, 0])
    assert np.isfinite(weights).all(), "unwritten memory is NaN in tests"
