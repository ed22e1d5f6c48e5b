"""Networks with a memory against what is known of them: what they are without it, what they keep, and where they come to rest."""

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

import baldwinlab as bl
from baldwinlab.api.checks import REQUIREMENTS
from baldwinlab.api.checks.reference import Naive
from baldwinlab.experiment import Experiment, ExperimentError, registry
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from baldwinlab.models.miniworld.networks.feed_forward import Rows
from baldwinlab.papers.presets import load
from baldwinlab.parts.part import compiled_values
from baldwinlab.simulation.replay import replay
from baldwinlab.simulation.simulate import simulate
from tests.worlds import make_small_experiment

INPUTS, ACTIONS = 3, 3
NAMES = ["simple-recurrent", "continuous-time"]


class Net:
    """A network of one agent, in plain Python: what it answers, step after step. Newborn, all its units are 0."""

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
        given = np.zeros(self.experiment.weight_count) if weights is None else np.asarray(weights)
        self.weights: Rows = given.astype(np.float32).reshape(-1, 1).copy()
        self.units: Rows = np.zeros((sum(self.experiment.layer_sizes), 1), np.float32)

    def layer(self, number: int) -> npt.NDArray[np.float32]:
        """A view of the weights of a layer, [from, to]."""
        bias, sizes = int(self.experiment.network.biases), self.experiment.layer_sizes
        counts = [(a + bias) * b for a, b in pairwise(sizes)]
        first = sum(counts[:number])
        return self.weights[first : first + counts[number], 0].reshape(-1, sizes[number + 1])

    def answer(self, *inputs: float) -> npt.NDArray[np.float32]:
        self.units[:INPUTS, 0] = inputs
        self.part.forward(self.values, self.weights, self.units, 0)
        return self.units[-ACTIONS:, 0].copy()

    def learn(self, rate: float, target: Sequence[float]) -> None:
        targets, errors = np.array(target, np.float32).reshape(-1, 1), np.zeros_like(self.units)
        self.part.backward(
            self.values, np.float32(rate), self.weights, self.units, errors, targets, 0
        )


def senses(steps: int, seed: int = 1) -> npt.NDArray[np.int64]:
    return np.random.default_rng(seed).integers(0, 2, (steps, INPUTS))


def with_random_weights(kind: str, hidden: Sequence[int], biases: bool, **fields: Any) -> Net:
    net = Net(kind, hidden, biases=biases, **fields)
    net.weights[:, 0] = np.random.default_rng(5).normal(size=len(net.weights))
    return net


def without_memory(net: Net, hidden: Sequence[int], biases: bool) -> Net:
    """The feed-forward network with the same weights, once those of what is remembered are 0."""
    context = slice(INPUTS, INPUTS + hidden[0])
    net.layer(0)[context] = 0
    kept = np.delete(net.layer(0), np.arange(INPUTS, INPUTS + hidden[0]), axis=0)
    later = net.weights[net.layer(0).size :, 0]
    return Net("feed-forward", hidden, np.concatenate([kept.ravel(), later]), biases)


@pytest.mark.parametrize("biases", [False, True])
@pytest.mark.parametrize(
    ("kind", "hidden"),
    [("simple-recurrent", [4]), ("simple-recurrent", [4, 2]), ("continuous-time", [4])],
)
def test_who_gives_no_weight_to_what_it_remembers_has_the_bits_of_a_feed_forward_network(
    kind: str, hidden: list[int], biases: bool
) -> None:
    fields = {"time_constant": 1.0} if kind == "continuous-time" else {}
    net = with_random_weights(kind, hidden, biases, **fields)
    plain = without_memory(net, hidden, biases)
    for inputs in senses(30):
        assert net.answer(*inputs).tobytes() == plain.answer(*inputs).tobytes()


@pytest.mark.parametrize("kind", NAMES)
def test_otherwise_it_answers_otherwise_to_the_same_inputs(kind: str) -> None:
    net = with_random_weights(kind, [4], False)
    assert (net.answer(1, 0, 1) != net.answer(1, 0, 1)).all()


def test_a_simple_recurrent_network_can_answer_what_it_sensed_a_step_before() -> None:
    """One hidden unit holds the input, the other what the first one was: a delay line, written by hand."""
    net, strong = Net("simple-recurrent", [2], biases=True), 20.0
    first, second = net.layer(0), net.layer(1)
    first[0, 0], first[INPUTS, 1] = strong, strong  # input to unit 0; what unit 0 was to unit 1
    first[-1] = second[-1] = -strong / 2
    second[1] = strong
    inputs = senses(40)
    for step, now in enumerate(inputs):
        answered = net.answer(*now).round().astype(int)
        assert set(answered) == {inputs[step - 1, 0] if step else 0}


def test_two_hidden_units_that_hear_each_other_count_to_two() -> None:
    """Parity in time: a network without memory cannot tell whether it has sensed an odd number of items."""
    net, strong = Net("simple-recurrent", [3], biases=True), 40.0
    first, second = net.layer(0), net.layer(1)
    odd = [
        1,
        2,
    ]  # exclusive or of the input and of what was odd: unit 1 if only the input is, unit 2 if only the memory is
    first[0, odd], first[[[INPUTS + 1], [INPUTS + 2]], odd] = [strong, -strong], [-strong, strong]
    first[-1, odd] = -strong / 2
    second[odd], second[-1] = strong, -strong / 2
    inputs = senses(60, seed=2)
    for step, now in enumerate(inputs):
        assert set(net.answer(*now).round().astype(int)) == {inputs[: step + 1, 0].sum() % 2}


def test_a_simple_recurrent_network_learns_down_the_gradient_with_what_it_remembers_held_fixed() -> (
    None
):
    net, target, rate, tiny = (
        with_random_weights("simple-recurrent", [3], True),
        [0.9, 0.2, 0.6],
        0.5,
        1e-6,
    )
    for inputs in senses(4):
        net.answer(*inputs)
    before, seen = net.weights[:, 0].astype(float), net.units[: INPUTS + 3, 0].astype(float)
    assert (seen[INPUTS:] > 0).all(), "it does remember something"
    naive = Naive(net.experiment.layer_sizes, True, 1, 1, 1, 0)

    def half_squared_error(weights: npt.NDArray[np.float64]) -> float:
        outputs = naive.think(naive.module(weights.tolist()), seen.tolist())
        return sum((output - goal) ** 2 for output, goal in zip(outputs, target, strict=True)) / 2

    net.learn(rate, target)
    for index, change in enumerate(net.weights[:, 0] - before):
        step = tiny * np.eye(before.size)[index]
        slope = (half_squared_error(before + step) - half_squared_error(before - step)) / (2 * tiny)
        assert change == pytest.approx(-rate * slope, abs=1e-6)


def leaky(
    time_constant: float, bias: float = 0.0, to_itself: float = 0.0, from_input: float = 0.0
) -> Net:
    """A single hidden unit."""
    net = Net("continuous-time", [1], biases=True, time_constant=time_constant)
    net.layer(0)[:, 0] = [from_input, 0, 0, to_itself, bias]
    return net


def state(net: Net) -> float:
    return float(net.units[INPUTS, 0])


def test_a_unit_that_hears_nothing_but_an_input_charges_and_leaks_like_a_capacitor() -> None:
    net = leaky(5.0, from_input=2.0)
    for step in range(1, 31):
        net.answer(1, 0, 0)
        assert state(net) == pytest.approx(2 * (1 - 0.8**step), abs=1e-5)
    charged = state(net)
    for step in range(1, 31):
        net.answer(0, 0, 0)
        assert state(net) == pytest.approx(charged * 0.8**step, abs=1e-5)


@pytest.mark.parametrize("time_constant", [2.0, 4.0, 20.0])
@pytest.mark.parametrize(
    ("to_itself", "bias", "drive"),
    [(3.0, -1.0, 0.5), (-6.0, 2.0, 1.0), (0.0, 1.0, -2.0), (3.9, 0.0, -2.0)],
)
def test_a_unit_comes_to_rest_at_its_fixed_point_however_slow_it_is(
    to_itself: float, bias: float, drive: float, time_constant: float
) -> None:
    net = leaky(time_constant, bias, to_itself, drive)
    for _ in range(60 * int(time_constant) + 300):
        net.answer(1, 0, 0)
    rest = brentq(lambda y: to_itself / (1 + math.exp(-y - bias)) + drive - y, -20, 20)
    assert state(net) == pytest.approx(rest, abs=1e-4)


def test_a_step_as_long_as_the_time_constant_is_too_coarse_for_strong_inhibition() -> None:
    """Its fixed point y = -2 has the slope -6/4 there, beyond -1: in steps, not in continuous time, it goes to and fro."""
    net = leaky(1.0, 2.0, -6.0, 1.0)
    found = []
    for _ in range(100):
        net.answer(1, 0, 0)
        found.append(state(net))
    assert found[-1] == pytest.approx(found[-3], abs=1e-5)
    assert abs(found[-1] - found[-2]) > 1


@pytest.mark.parametrize(("to_itself", "rests"), [(3.5, 1), (8.0, 2)])
def test_a_unit_that_excites_itself_by_more_than_4_has_two_places_to_rest(
    to_itself: float, rests: int
) -> None:
    """Beer 1995, "Single CTRNNs": with a bias of half as much below 0 they lie around the unstable one in the middle."""
    net, found = leaky(4.0, -to_itself / 2, to_itself), []
    for start in (0.0, to_itself):
        net.units[INPUTS, 0] = start
        for _ in range(800):
            net.answer(0, 0, 0)
        found.append(round(state(net), 3))
    assert len(set(found)) == rests
    assert sum(found) == pytest.approx(to_itself, abs=0.01), "they are mirror images of each other"


@pytest.mark.parametrize("biases", [False, True])
def test_a_continuous_time_network_is_its_oracle_s_with_biases_and_without(biases: bool) -> None:
    net = with_random_weights("continuous-time", [5], biases, time_constant=3.0)
    naive = Naive(net.experiment.layer_sizes, biases, 1, 1, 1, 0)
    module = naive.module(net.weights[:, 0].tolist())
    agent = SimpleNamespace(action_module=module, arrays={})
    for inputs in senses(60):
        agent.inputs = inputs.tolist()
        np.testing.assert_allclose(
            net.answer(*inputs), net.part.oracle(net.values, agent, naive), atol=1e-5
        )


@pytest.mark.parametrize("biases", [False, True])
def test_of_a_continuous_time_network_the_output_weights_alone_learn_and_the_error_shrinks(
    biases: bool,
) -> None:
    net, target = with_random_weights("continuous-time", [4], biases), np.array([0.9, 0.1, 0.5])
    for inputs in senses(5):
        net.answer(*inputs)
    units, before, output = net.units[:, 0].copy(), net.layer(0).copy(), net.layer(1).copy()
    net.learn(0.5, target.tolist())
    assert (net.layer(0) == before).all()
    y, fired = (
        units[-ACTIONS:].astype(float),
        np.append(units[INPUTS + 4 : INPUTS + 8], [1.0] * biases),
    )
    np.testing.assert_allclose(
        net.layer(1), output - 0.5 * np.outer(fired, (y - target) * y * (1 - y)), atol=1e-6
    )
    for _ in range(3000):
        net.learn(0.5, target.tolist())
        net.units[INPUTS:-ACTIONS, 0] = units[INPUTS:-ACTIONS]
        net.units[-ACTIONS:, 0] = 1 / (1 + np.exp(-fired @ net.layer(1)))
    np.testing.assert_allclose(net.units[-ACTIONS:, 0], target, atol=0.02)


def test_each_needs_the_hidden_units_that_it_hears() -> None:
    with pytest.raises(ExperimentError, match=r"network\.hidden must have at least one layer"):
        load("evo/A").replace(network={"kind": "simple-recurrent", "hidden": []})
    for hidden in ([], [3, 3]):
        with pytest.raises(ExperimentError, match=r"network\.hidden must have one entry"):
            load("evo/A").replace(network={"kind": "continuous-time", "hidden": hidden})


def test_in_a_life_that_senses_nothing_the_compiled_network_does_what_it_does_in_plain_python() -> (
    None
):
    experiment = make_small_experiment(
        "evo", network={"kind": "continuous-time"}, world={"food": []}, lifetime={"steps": 12}
    )
    trace = replay(experiment, seed=1)
    assert not trace.sensor.any()
    for agent in range(2):
        net = Net(
            "continuous-time", experiment.network.hidden, trace.weight_birth.values[agent].ravel()
        )
        expected = np.stack([net.answer(0, 0, 0) for _ in range(12)])
        assert trace.output.values[:, agent].astype(np.float32).tobytes() == expected.tobytes()


@pytest.mark.nightly  # each network is compiled with a rule, for both updates and for a SIMD block
def test_the_parts_keep_the_whole_contract() -> None:
    parts = [registry.find("network", name) for name in NAMES]
    found = bl.check_part(parts, requirements=[name for name in REQUIREMENTS if name != "speed"])
    assert all(each.holds is not False for each in found), "\n".join(map(str, found))


@pytest.mark.parametrize("kind", NAMES)
def test_under_drift_a_newborn_of_any_generation_remembers_nothing(
    kind: str, in_plain_python: None
) -> None:
    """The shadow of a newborn has no memory, although the memory of the machine holds that of an earlier generation."""
    drifting = make_small_experiment(
        "evo+self-taught",
        learning={"rule": "drift", "rate": 0.5},
        network={"kind": kind},
        lifetime={"steps": 9},
    )
    run = simulate(drifting, seed=2)
    weights = replay(drifting, seed=2, generation=2)["weight_death"].values
    batch = CpuBatch(drifting, 2, [0])
    for generation in range(3):
        batch.begin(generation, run["genome"].values[generation][None])
        batch.simulate(0, 9)
    np.testing.assert_array_equal(batch.weights()[0], weights[:, 0])
    assert np.isfinite(weights).all(), "as an unwritten memory is not a number in these tests"
