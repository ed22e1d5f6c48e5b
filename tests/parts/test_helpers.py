"""Test the helpers for custom parts against plain Python."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from baldwinlab import parts
from baldwinlab.api.checks.oracles import make_naive
from baldwinlab.experiment import registry
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from baldwinlab.models.miniworld.items import resort_stale_cells
from baldwinlab.models.miniworld.senses.other_agents import AgentSense
from baldwinlab.models.miniworld.senses.real_valued import ItemSense
from baldwinlab.parts import (
    ENERGY_ARRAYS,
    ENERGY_VALUES,
    LIFE,
    LineOfSight,
    Network,
    PartError,
    Synapse,
    SynapticRule,
    Training,
    get,
    per_agent,
    put,
    reset_energy,
    update_energy,
)
from tests.models.miniworld.plain import draw_founders, replay_in_python, simulate_steps
from tests.worlds import make_single_agent_experiment, make_small_experiment

pytestmark = pytest.mark.usefixtures("in_plain_python")

SPAN = np.float32(120)
PATCH = {"patches": [[0, 10, 0, 10, 3, -1]]}
POSITIONS = st.floats(0, 119, width=32)


class Oja(SynapticRule, name="test-oja"):
    """Oja's rule."""

    @staticmethod
    def compute_change(part: Any, state: Any, synapse: Synapse, lane: Any) -> Any:
        return synapse.y * (synapse.x - synapse.y * synapse.weight)


class Rewarded(SynapticRule, name="test-rewarded"):
    """A rule that changes weights by the energy gained in the last step."""

    arrays = ENERGY_ARRAYS
    derived = {**SynapticRule.derived, **ENERGY_VALUES}  # noqa: RUF012
    init_agent = staticmethod(reset_energy)
    observe_others = staticmethod(update_energy)

    @staticmethod
    def compute_change(part: Any, state: Any, synapse: Synapse, lane: Any) -> Any:
        return get(part.energy_gained, 0, lane) + np.float32(0) * synapse.weight


def write_count(record: Any, part: Any, model: Any, state: Any, place: tuple[int, int]) -> None:
    """Write the number of recorded items or agents as n / (1 + n)."""
    world, agent = place
    lane = world * model.agents + agent
    part.count[0, lane] = np.float32(0)
    record(part, model, state, world, agent)
    count = part.count[0, lane]
    put(state.activations, part.first_input, lane, count / (np.float32(1) + count))


class ItemCount(ItemSense, name="test-item-count"):
    """Number of visible items, as n / (1 + n)."""

    inputs = ("items",)
    sectors = (None,)
    arrays = {"count": per_agent(1)}  # noqa: RUF012

    @staticmethod
    def record_item(part: Any, model: Any, state: Any, line: LineOfSight, lane: int) -> None:
        if parts.is_within_sight(model, state, line):
            part.count[0, lane] += np.float32(1)

    @staticmethod
    def measure(part: Any, model: Any, state: Any, world: int, agent: int) -> None:
        write_count(parts.record_items, part, model, state, (world, agent))


class AgentCount(AgentSense, name="test-agent-count"):
    """Number of visible agents, as n / (1 + n)."""

    inputs = ("agents",)
    sectors = (None,)
    is_continuous = True
    arrays = {**AgentSense.arrays, "count": per_agent(1)}  # noqa: RUF012

    @staticmethod
    def record_agent(part: Any, model: Any, state: Any, line: LineOfSight, lane: int) -> None:
        part.count[0, lane] += np.float32(1)

    @staticmethod
    def measure(part: Any, model: Any, state: Any, world: int, agent: int) -> None:
        write_count(parts.record_agents, part, model, state, (world, agent))


@pytest.fixture(scope="module", autouse=True)
def _remove_parts() -> Iterator[None]:
    """Remove the parts of this module. Other modules define parts when they are collected."""
    yield
    names = {"test-oja", "test-rewarded", "test-item-count", "test-agent-count"}
    for kind, name in list(registry.custom_parts()):
        if name in names or name.startswith("test-wrong"):
            registry.remove(kind, name)


def make_batch(**changes: Any) -> CpuBatch:
    """Return a batch after the first step of a lifetime."""
    experiment = make_small_experiment("evo", lifetime={"steps": 40}, **changes)
    return simulate_steps(experiment, draw_founders(experiment), 1)


def test_every_public_name_exists_and_no_other() -> None:
    assert [name for name in parts.__all__ if not hasattr(parts, name)] == []
    assert (parts.AgentSense, parts.ItemSense) == (AgentSense, ItemSense)
    with pytest.raises(AttributeError, match=r"'baldwinlab\.parts' has no attribute 'unknown'"):
        _ = parts.unknown


@given(POSITIONS, POSITIONS)
def test_the_shortest_difference_is_the_difference_to_the_nearest_image(
    start: float, end: float
) -> None:
    difference = parts.shortest_difference(np.float32(end - start), SPAN)
    candidates = [end + image * 120 - start for image in (-1, 0, 1)]
    assert abs(difference) == pytest.approx(min(map(abs, candidates)), abs=1e-4)
    assert math.isclose((start + difference - end) % 120 % 120, 0, abs_tol=1e-4) or math.isclose(
        (start + difference - end) % 120, 120, abs_tol=1e-4
    )


@given(st.floats(-119, 239, width=32))
def test_a_wrapped_position_is_on_the_map(position: float) -> None:
    wrapped = parts.wrap_position(np.float32(position), SPAN)
    assert 0 <= wrapped <= 120
    assert wrapped == pytest.approx(position % 120, abs=1e-4) or position % 120 > 119.99


def test_a_purpose_is_a_hash_above_the_purposes_of_the_package() -> None:
    digest = int.from_bytes(hashlib.sha256(b"my-part").digest()[:8], "little")
    assert parts.purpose("my-part") == 2**16 + digest % (2**31 - 2**16)
    purposes = {parts.purpose(f"name {number}") for number in range(1000)}
    assert len(purposes) == 1000
    assert all(2**16 <= number < 2**31 for number in purposes)


def test_a_drawn_number_depends_on_each_argument() -> None:
    state = make_batch().state
    arguments = {"world": 0, "purpose": LIFE, "index": 3, "draw": 4}
    number = parts.draw_unit(state, **arguments)
    assert 0 <= number < 1
    assert parts.draw_unit(state, **arguments) == number
    for name in ("purpose", "index", "draw"):
        assert parts.draw_unit(state, **arguments | {name: arguments[name] + 1}) != number
    numbers = [parts.draw_unit(state, 0, LIFE, 0, draw) for draw in range(1000)]
    assert np.mean(numbers) == pytest.approx(0.5, abs=0.03)


def test_a_removed_item_is_seen_again_only_after_it_is_placed() -> None:
    experiment = make_single_agent_experiment((100, 80), [(110, 80)], lifetime={"steps": 9})
    batch = simulate_steps(experiment, draw_founders(experiment), 1)
    model, state = batch.model, batch.state

    def front(step: int) -> float:
        # The agent stays in the middle, and senses in each step.
        state.positions[:, 0] = 100, 80
        state.heading[0, 0] = 0
        batch.simulate(step, step + 1)
        return float(state.activations[1, 0])

    assert front(1) == 1
    parts.remove_item(model, state, 0, 0, 0)
    assert not parts.is_on_map(state, 0, 0)
    assert front(2) == 0
    parts.place_item_at(model, state, 0, 0, 0, np.float32(115), np.float32(80))
    assert parts.is_on_map(state, 0, 0)
    assert front(3) == 1
    parts.place_item_at(model, state, 0, 0, 0, np.float32(80), np.float32(80))
    assert front(4) == 0
    parts.place_item_randomly(model, state, 0, 0, 0)
    assert (state.item_x[0, 0], state.item_y[0, 0]) == pytest.approx((110, 80), abs=1e-4)
    assert front(5) == 1


def test_a_change_of_items_keeps_the_grid_of_a_large_region_sorted() -> None:
    food = [{"x": [0, 120], "y": [0, 100], "count": 400}]
    batch = make_batch(world={"food": food}, senses={"visual_radius": 4})
    model, state = batch.model, batch.state
    assert model.grid.prod() > 1
    random = np.random.default_rng(1)
    for item in range(0, 400, 7):
        parts.remove_item(model, state, 0, 0, item)
    for item in range(0, 400, 14):
        x, y = random.uniform(1, 99, 2).astype(np.float32)
        parts.place_item_at(model, state, 0, 0, item, x, y)
    changed = {name: getattr(state, name).copy() for name in ("slot_x", "slot_item", "cell_slots")}
    state.stale[:] = 1
    resort_stale_cells(model, state, 0)
    for name, array in changed.items():
        np.testing.assert_array_equal(array, getattr(state, name))
    assert sum(parts.is_on_map(state, 0, item) for item in range(400)) == 400 - 58 + 29


def test_an_item_was_eaten_in_the_step_in_which_the_number_of_eaten_items_grows() -> None:
    batch = make_batch()
    eaten = 0
    for step in range(1, 40):
        before = batch.eaten_in_life().sum()
        batch.simulate(step, step + 1)
        now = sum(parts.was_eaten(batch.state, 0, item, step) for item in range(12))
        assert now == batch.eaten_in_life().sum() - before
        eaten += now
    assert eaten > 0


def test_the_energy_gained_in_a_step_is_the_energy_of_the_items_of_the_previous_step() -> None:
    food = [
        {"x": [20, 100], "y": [10, 90], "count": 12, "energy": 2},
        {"x": [20, 100], "y": [10, 90], "count": 12, "energy": 0.5},
    ]
    batch = make_batch(world={"food": food}, learning={"rule": "test-rewarded", "rate": 0.1})
    energies = np.array([2, 0.5])
    eaten = batch.eaten_in_life()[0]
    has_changed = False
    for step in range(1, 40):
        weights = batch.weights()[0]
        expected = eaten @ energies
        batch.simulate(step, step + 1)
        rule = batch.state.rule
        np.testing.assert_array_equal(rule.energy[0, :6], expected)
        gained = rule.energy_gained[0, :6]
        change = batch.weights()[0] - weights
        np.testing.assert_allclose(change, np.tile(0.1 * gained, (change.shape[1], 1)).T, atol=1e-5)
        has_changed |= bool(gained.any())
        eaten = batch.eaten_in_life()[0]
    assert has_changed


@pytest.mark.parametrize("biases", [False, True])
def test_a_rule_in_one_expression_changes_every_weight(biases: bool) -> None:
    experiment = make_small_experiment(
        "evo", learning={"rule": "test-oja", "rate": 0.1}, network={"biases": biases}
    )
    batch = simulate_steps(experiment, draw_founders(experiment), 3)
    naive = make_naive(experiment, 0)
    weights = batch.weights()[0]
    batch.simulate(3, 4)
    for number in range(6):
        module = naive.module(weights[number].tolist())
        inputs = batch.state.activations[: batch.model.inputs, number].tolist()
        agent = type("Agent", (), {"action_module": module, "inputs": inputs})
        for row, unit, x, y in naive.synapses(agent):
            row[unit] += 0.1 * y * (x - y * row[unit])
        np.testing.assert_allclose(batch.weights()[0, number], naive.weights(module), atol=1e-5)


def test_the_items_and_agents_within_sight_are_counted() -> None:
    experiment = make_small_experiment(
        "evo",
        senses={"kinds": ["test-item-count", "test-agent-count"], "visual_radius": 25},
        lifetime={"steps": 10},
    )
    trace = replay_in_python(experiment)

    def count_within(x: Any, y: Any, other_x: Any, other_y: Any) -> int:
        dx = np.abs(other_x - x)
        dy = np.abs(other_y - y)
        distance = np.hypot(np.minimum(dx, 120 - dx), np.minimum(dy, 100 - dy))
        return int((distance <= 25).sum())

    x, y = trace.x.values, trace.y.values
    for step in range(10):
        for agent in range(6):
            position = x[step, agent], y[step, agent]
            items = count_within(*position, trace.item_x[step].values, trace.item_y[step].values)
            agents = count_within(*position, x[step], y[step]) - 1
            expected = [items / (1 + items), agents / (1 + agents)]
            assert trace.sensor.values[step, agent] == pytest.approx(expected)


def test_the_regions_of_items_include_those_of_features() -> None:
    experiment = make_small_experiment("evo", world={"features": ["patches"], "patches": PATCH})
    assert [region.kind for region in parts.item_regions(experiment)] == ["food", "patch"]


def test_a_synaptic_rule_with_other_arguments_is_refused() -> None:
    with pytest.raises(TypeError, match="compute_change must have the arguments of its kind"):

        class Wrong(SynapticRule, name="test-wrong"):
            @staticmethod
            def compute_change(part: Any, x: Any, y: Any) -> Any:
                return x * y


def test_a_rule_or_network_that_reads_or_writes_another_agent_is_refused() -> None:
    with pytest.raises(PartError, match="compute_change reads or writes other agents"):

        class WrongRule(SynapticRule, name="test-wrong"):
            @staticmethod
            def compute_change(part: Any, state: Any, synapse: Synapse, lane: Any) -> Any:
                return get(state.weights, synapse.number, lane + 1)

    with pytest.raises(PartError, match="backward reads or writes other agents"):

        class WrongNetwork(Network, name="test-wrong-network"):
            @staticmethod
            def backward(part: Any, training: Training, lane: Any) -> None:
                put(training.weights, 0, lane + 1, training.rate)
