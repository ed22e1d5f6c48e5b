"""What an agent sees of items of a kind: three binary sensors, left, front and right.

With u and v an item's coordinates along and across the heading (v to the right, as y points down), its bearing theta is in
front when |v| <= u tan 15, and at a side when u tan 15 < |v| < u: no angle is ever computed.

Source: the paper, "The Simulated World of Foods and Agents", on theta; docs/explanation/model.md for the boundaries (R8).
"""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np

from baldwinlab.engine.jit import compiled, register
from baldwinlab.engine.phases import for_each, part_class, select_by_type
from baldwinlab.engine.simd import (
    Lane,
    Mask,
    Value,
    any_of,
    choose,
    get,
    lanes_in_block,
    negated,
    put,
    simd_block,
)
from baldwinlab.models.miniworld.items import (
    find_cells_within,
    find_slots,
    find_slots_in_row,
    has_single_cell,
    nearest_image,
    position_in_image,
)
from baldwinlab.models.miniworld.lookup import look_up_outputs
from baldwinlab.models.miniworld.map import combine_masks, shortest_difference
from baldwinlab.models.miniworld.state import FOOD, Model, State
from baldwinlab.parts.agent_parts import Sense, blocks_sight, measure, sense

ZERO, HALF, ONE = np.float32(0), np.float32(0.5), np.float32(1)
TAN_15 = np.float32(math.tan(math.radians(15)))
LEFT, FRONT, RIGHT, ALERT = 1, 2, 4, 8

Hits = tuple[
    Mask, Mask, Mask, Mask
]  # where items are at the left, in front, at the right, and near enough to be touched soon


@compiled
def _exclude_hidden(
    features: Any, model: Model, x: np.float32, y: np.float32, dx: Value, dy: Value, seen: Mask
) -> Mask:
    return seen & negated(is_hidden(features, model, x, y, dx, dy))


@compiled
def _exclude_nothing(
    features: Any, model: Model, x: np.float32, y: np.float32, dx: Value, dy: Value, seen: Mask
) -> Mask:
    return seen


is_hidden = for_each(blocks_sight, False, combine_masks)
select_visible = select_by_type(_exclude_hidden, _exclude_nothing)


@compiled
def mark_agents_near_regions(model: Model, state: State, lane: Lane) -> None:
    """Mark the agents that are near any region, for the others sense no items: most often so, and quickly told.

    Who was near in the last step is asked by its senses once more, so that it forgets what it saw.
    """
    put(state.near, 0, lane, choose(get(state.near, 0, lane) > HALF, HALF, model.least_near))
    reach = max(model.visual_radius, model.alert_radius) + ONE  # with room for rounding
    for region in range(model.regions.shape[0]):
        half_width, half_height = model.regions[region, 1] * HALF, model.regions[region, 3] * HALF
        centre_x, centre_y = (
            model.regions[region, 0] + half_width,
            model.regions[region, 2] + half_height,
        )
        x, y = get(state.positions, 0, lane), get(state.positions, 1, lane)
        put(state.image_x, region, lane, nearest_image(x, centre_x, model.width))
        put(state.image_y, region, lane, nearest_image(y, centre_y, model.height))
        dx, dy = (
            shortest_difference(x - centre_x, model.width),
            shortest_difference(y - centre_y, model.height),
        )
        near = (abs(dx) <= half_width + reach) & (abs(dy) <= half_height + reach)
        put(state.near, 0, lane, choose(near, ONE, get(state.near, 0, lane)))


@compiled
def test_sectors(
    model: Model, state: State, x: np.float32, y: np.float32, dx: Value, dy: Value, heading: int
) -> tuple[Mask, Mask, Mask]:
    """Where left, front and right see from (x, y) what is (dx, dy) away."""
    u = dx * model.cosine[heading] + dy * model.sine[heading]
    v = dy * model.cosine[heading] - dx * model.sine[heading]
    edge = u * TAN_15
    aside = abs(v)
    in_sight = dx * dx + dy * dy <= model.visual_radius * model.visual_radius
    seen = select_visible(state.features, model, x, y, dx, dy, in_sight)
    front = seen & ((aside < edge) if model.open_boundaries else (aside <= edge))
    side = seen & (aside > edge) & (aside < u)
    return side & (v < ZERO), front, side & (v > ZERO)


@compiled
def pack_sectors(left: Mask, front: Mask, right: Mask) -> int:
    """Which of left, front and right see anything."""
    return LEFT * int(any_of(left)) | FRONT * int(any_of(front)) | RIGHT * int(any_of(right))


@compiled
def _merge_hits(one: Hits, other: Hits) -> Hits:
    """What is spotted in any of two SIMD blocks."""
    return one[0] | other[0], one[1] | other[1], one[2] | other[2], one[3] | other[3]


@compiled
def _pack_hits(spotted: Hits) -> int:
    """What an agent gets to know, as bits."""
    left, front, right, near = spotted
    return pack_sectors(left, front, right) | ALERT * int(any_of(near))


@compiled
def _test_items(
    model: Model, state: State, world: int, slot: Lane, x: np.float32, y: np.float32, heading: int
) -> Hits:
    """Which items in these slots are seen at the left, in front and at the right, and which may be touched soon."""
    dx = get(state.slot_x, world, slot) - x
    dy = get(state.slot_y, world, slot) - y
    near = dx * dx + dy * dy <= model.alert_radius * model.alert_radius
    left, front, right = test_sectors(model, state, x, y, dx, dy, heading)
    return left, front, right, near


@compiled
def _test_slots(
    model: Model,
    state: State,
    world: int,
    slots: tuple[int, int],
    x: np.float32,
    y: np.float32,
    heading: int,
) -> Hits:
    """As `_test_items`, from the first of `slots`, without the second; but a bundle at least: what is found beyond is there as well."""
    begin, end = slots
    spotted = _test_items(model, state, world, simd_block(begin), x, y, heading)
    for first in range(begin + lanes_in_block(), end, lanes_in_block()):
        spotted = _merge_hits(
            spotted, _test_items(model, state, world, simd_block(first), x, y, heading)
        )
    return spotted


@compiled
def _scan_cells(
    model: Model, state: State, world: int, region: int, x: np.float32, y: np.float32, heading: int
) -> int:
    """What an agent at (x, y) gets to know of a region, as bits: told once, for that takes as long as a bundle."""
    farthest = max(model.visual_radius, model.alert_radius)
    columns = find_cells_within(model, region, 0, x, farthest)
    first_row, last_row = find_cells_within(model, region, 1, y, farthest)
    if columns[0] == columns[1] or first_row == last_row:
        return 0
    slots = find_slots_in_row(model, state, world, region, first_row, columns)
    spotted = _test_slots(model, state, world, slots, x, y, heading)
    for row in range(first_row + 1, last_row):
        slots = find_slots_in_row(model, state, world, region, row, columns)
        spotted = _merge_hits(spotted, _test_slots(model, state, world, slots, x, y, heading))
    return _pack_hits(spotted)


@compiled
def _scan_region(model: Model, state: State, world: int, region: int, lane: int) -> int:
    """What an agent gets to know of a region, as bits: from beside it, where it is reached from one image alone, as most are."""
    heading = int(get(state.heading, 0, lane))
    if model.images[region] == 1:
        x, y = get(state.image_x, region, lane), get(state.image_y, region, lane)
        if has_single_cell(model, region):
            return _pack_hits(
                _test_slots(model, state, world, find_slots(model, region), x, y, heading)
            )
        return _scan_cells(model, state, world, region, x, y, heading)
    bits = 0
    for number in range(model.images[region]):
        x, y = position_in_image(
            model, region, number, get(state.positions, 0, lane), get(state.positions, 1, lane)
        )
        bits |= _scan_cells(model, state, world, region, x, y, heading)
    return bits


@compiled
def sense_items(model: Model, state: State, world: int, agent: int, kind: int) -> int:
    """Which of left, front and right see an item of a kind (its number), as bits; and be alert to those soon touched."""
    lane = world * model.agents + agent
    bits = 0
    for region in range(model.regions.shape[0] if get(state.near, 0, lane) > HALF else 0):
        if model.region_kind[region] == kind:
            bits |= _scan_region(model, state, world, region, lane)
    put(state.alert, 0, lane, get(state.alert, 0, lane) | (bits & ALERT))
    return bits & (LEFT | FRONT | RIGHT)


class Sight(Sense, name="food"):
    """Three binary inputs: food in the left, front and right sector.

    References
    ----------
    Le 2019.
    """

    inputs: ClassVar[tuple[str, ...]] = ("left", "front", "right")
    sectors: ClassVar[tuple[tuple[float, float] | None, ...]] = ((315, 345), (345, 15), (15, 45))
    item_kind: ClassVar[str] = FOOD
    only_items: ClassVar[bool] = True

    @staticmethod
    def sense(part: Any, model: Model, state: State, world: int, agent: int) -> int:
        return sense_items(model, state, world, agent, 0)

    @staticmethod
    def oracle(part: Any, agent: Any, items: Any, naive: Any) -> Any:
        return naive.seen(agent, [item for item in items if item.kind == FOOD])


def _sense_all(senses: Any, model: Any, state: Any, world: int, agent: int) -> int:
    """What all senses tell, as bits, one sense's above the other's."""
    code, first = 0, 0
    for one in senses:
        code |= sense(one, model, state, world, agent) << first
        first += len(type(one).part.inputs)
    return code


def _choose_sense_all(senses: Any, model: Any, state: Any, world: Any, agent: Any) -> Any:
    if len(senses) == 1:
        return lambda senses, model, state, world, agent: sense(
            senses[0], model, state, world, agent
        )
    own = len(part_class(senses[0]).inputs)
    return lambda senses, model, state, world, agent: (
        sense(senses[0], model, state, world, agent)
        | (sense_all(senses[1:], model, state, world, agent) << own)
    )


sense_all = register(_sense_all, _choose_sense_all)


@compiled
def _write_bits(
    one: Any, count: int, model: Any, state: Any, world: int, agent: int, first: int
) -> None:
    code = sense(one, model, state, world, agent)
    for k in range(count):
        state.activations[first + k, world * model.agents + agent] = np.float32((code >> k) & 1)


def _write_inputs(senses: Any, model: Any, state: Any, world: int, agent: int, first: int) -> None:
    """Set the agent's inputs from the row `first` on, one sense after the other."""
    for one in senses:
        if type(one).part.is_continuous:
            measure(one, model, state, world, agent, first)
        else:
            _write_bits(one, len(type(one).part.inputs), model, state, world, agent, first)
        first += len(type(one).part.inputs)


def _choose_write_inputs(
    senses: Any, model: Any, state: Any, world: Any, agent: Any, first: Any
) -> Any:
    if len(senses) == 0:
        return lambda senses, model, state, world, agent, first: None
    part = part_class(senses[0])
    count, is_continuous = len(part.inputs), part.is_continuous

    def write(senses: Any, model: Any, state: Any, world: int, agent: int, first: int) -> None:
        if is_continuous:
            measure(senses[0], model, state, world, agent, first)
        else:
            _write_bits(senses[0], count, model, state, world, agent, first)
        write_inputs(senses[1:], model, state, world, agent, first + count)

    return write


write_inputs = register(_write_inputs, _choose_write_inputs)


@compiled
def _set_continuous_inputs(senses: Any, model: Model, state: State, world: int, agent: int) -> None:
    """Set the agent's inputs, of which some are real-valued: nothing is looked up then."""
    write_inputs(senses, model, state, world, agent, 0)
    state.code[0, world * model.agents + agent] = 0


@compiled
def _set_binary_inputs(senses: Any, model: Model, state: State, world: int, agent: int) -> None:
    """Set the agent's inputs, and what follows from them alone, whether they have changed or not.

    To write them takes less time than the processor loses where it guesses wrong that they have not.
    """
    lane = world * model.agents + agent
    code = sense_all(senses, model, state, world, agent)
    put(state.code, 0, lane, code)
    for k in range(model.inputs):
        put(state.activations, k, lane, np.float32(code & 1))
        code >>= 1
    look_up_outputs(state.lookup, model, state, lane)


_set_inputs = select_by_type(
    _set_continuous_inputs, _set_binary_inputs, lambda part: bool(part.is_continuous)
)


@compiled
def list_sensing_agents(model: Model, state: State, world: int, first: int, last: int) -> int:
    """List in `awake` whose inputs may have changed, of the agents from `first` up to, and without, `last`; returns how many.

    Everybody is written down, and the next one over who is near nothing: to ask of each would be the processor's to guess.
    """
    count = 0
    for agent in range(first, last):
        put(state.near_agents, 0, world * model.agents + first + count, agent)
        count += int(get(state.near, 0, world * model.agents + agent) != ZERO)
    return count


@compiled
def perceive(model: Model, state: State, world: int, agent: int) -> None:
    """Let the agent's senses set its inputs."""
    lane = world * model.agents + agent
    put(state.alert, 0, lane, model.always_alert)
    _set_inputs(state.senses, model, state, world, agent)
