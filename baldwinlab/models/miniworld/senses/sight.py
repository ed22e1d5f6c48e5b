"""Sight of items of a kind: three binary sensors, left, front and right.

u and v are the coordinates of an item along and across the heading. v is positive to the right.
An item is in front if |v| <= u tan 15, and at a side if u tan 15 < |v| < u.
So no angle is computed.

Source: the paper, "The Simulated World of Foods and Agents", on theta.
`docs/explanation/model.md` describes the boundaries of the sectors (R8).
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
from baldwinlab.models.miniworld.state import FOOD, MiniWorldModel, State
from baldwinlab.parts.senses import Sense, measure, sense
from baldwinlab.parts.world_features import blocks_sight

ZERO = np.float32(0)
HALF = np.float32(0.5)
ONE = np.float32(1)
TAN_15 = np.float32(math.tan(math.radians(15)))
LEFT = 1
FRONT = 2
RIGHT = 4
ALERT = 8

# Where items are in the left, front and right sector, and near enough to be touched soon.
Hits = tuple[Mask, Mask, Mask, Mask]


@compiled
def _exclude_hidden(
    features: Any,
    model: MiniWorldModel,
    x: np.float32,
    y: np.float32,
    dx: Value,
    dy: Value,
    in_range: Mask,
) -> Mask:
    """Return the lanes in range that no feature hides."""
    return in_range & negated(is_hidden(features, model, x, y, dx, dy))


@compiled
def _exclude_nothing(
    features: Any,
    model: MiniWorldModel,
    x: np.float32,
    y: np.float32,
    dx: Value,
    dy: Value,
    in_range: Mask,
) -> Mask:
    """Return the lanes in range, if no feature blocks sight."""
    return in_range


is_hidden = for_each(blocks_sight, False, combine_masks)
select_visible = select_by_type(_exclude_hidden, _exclude_nothing)


@compiled
def mark_agents_near_regions(model: MiniWorldModel, state: State, lane: Lane) -> None:
    """Set `near` of the agents near any region. The others sense no items.

    An agent that was near in the last step senses once more, which clears its inputs.
    """
    put(state.near, 0, lane, choose(get(state.near, 0, lane) > HALF, HALF, model.least_near))
    # The margin covers rounding.
    reach = max(model.visual_radius, model.alert_radius) + ONE
    for region in range(model.regions.shape[0]):
        half_width = model.regions[region, 1] * HALF
        half_height = model.regions[region, 3] * HALF
        center_x = model.regions[region, 0] + half_width
        center_y = model.regions[region, 2] + half_height
        x = get(state.positions, 0, lane)
        y = get(state.positions, 1, lane)
        put(state.image_x, region, lane, nearest_image(x, center_x, model.width))
        put(state.image_y, region, lane, nearest_image(y, center_y, model.height))
        dx = shortest_difference(x - center_x, model.width)
        dy = shortest_difference(y - center_y, model.height)
        near = (abs(dx) <= half_width + reach) & (abs(dy) <= half_height + reach)
        put(state.near, 0, lane, choose(near, ONE, get(state.near, 0, lane)))


@compiled
def test_sectors(
    model: MiniWorldModel,
    state: State,
    x: np.float32,
    y: np.float32,
    dx: Value,
    dy: Value,
    heading: int,
) -> tuple[Mask, Mask, Mask]:
    """Return where an item (dx, dy) away from (x, y) is in the left, front and right sector."""
    u = dx * model.cosine[heading] + dy * model.sine[heading]
    v = dy * model.cosine[heading] - dx * model.sine[heading]
    edge = u * TAN_15
    across = abs(v)
    in_range = dx * dx + dy * dy <= model.visual_radius * model.visual_radius
    visible = select_visible(state.features, model, x, y, dx, dy, in_range)
    front = visible & ((across < edge) if model.open_boundaries else (across <= edge))
    side = visible & (across > edge) & (across < u)
    return side & (v < ZERO), front, side & (v > ZERO)


@compiled
def pack_sectors(left: Mask, front: Mask, right: Mask) -> int:
    """Return one bit for each sector: whether it contains an item."""
    return LEFT * int(any_of(left)) | FRONT * int(any_of(front)) | RIGHT * int(any_of(right))


@compiled
def _merge_hits(first: Hits, second: Hits) -> Hits:
    """Return the union of the hits of two SIMD blocks."""
    left = first[0] | second[0]
    front = first[1] | second[1]
    right = first[2] | second[2]
    near = first[3] | second[3]
    return left, front, right, near


@compiled
def _pack_hits(hits: Hits) -> int:
    """Return the sectors with items, and whether an item is near, as bits."""
    left, front, right, near = hits
    return pack_sectors(left, front, right) | ALERT * int(any_of(near))


@compiled
def _test_items(
    model: MiniWorldModel,
    state: State,
    world: int,
    slot: Lane,
    x: np.float32,
    y: np.float32,
    heading: int,
) -> Hits:
    """Return where the items in `slot` are in a sector, or near enough to be touched soon."""
    dx = get(state.slot_x, world, slot) - x
    dy = get(state.slot_y, world, slot) - y
    near = dx * dx + dy * dy <= model.alert_radius * model.alert_radius
    left, front, right = test_sectors(model, state, x, y, dx, dy, heading)
    return left, front, right, near


@compiled
def _test_slots(
    model: MiniWorldModel,
    state: State,
    world: int,
    slots: tuple[int, int],
    x: np.float32,
    y: np.float32,
    heading: int,
) -> Hits:
    """Test the items of a range of slots, at least one SIMD block.

    Items after the end of the range are tested as well, which is harmless.
    """
    begin, end = slots
    hits = _test_items(model, state, world, simd_block(begin), x, y, heading)
    for first in range(begin + lanes_in_block(), end, lanes_in_block()):
        hits = _merge_hits(hits, _test_items(model, state, world, simd_block(first), x, y, heading))
    return hits


@compiled
def _scan_cells(
    model: MiniWorldModel,
    state: State,
    world: int,
    region: int,
    x: np.float32,
    y: np.float32,
    heading: int,
) -> int:
    """Return what an agent at (x, y) senses of a region, as bits.

    The bits are packed once, as packing takes as long as the test of a SIMD block.
    """
    farthest = max(model.visual_radius, model.alert_radius)
    columns = find_cells_within(model, region, 0, x, farthest)
    first_row, last_row = find_cells_within(model, region, 1, y, farthest)
    if columns[0] == columns[1] or first_row == last_row:
        return 0
    slots = find_slots_in_row(model, state, world, region, first_row, columns)
    hits = _test_slots(model, state, world, slots, x, y, heading)
    for row in range(first_row + 1, last_row):
        slots = find_slots_in_row(model, state, world, region, row, columns)
        hits = _merge_hits(hits, _test_slots(model, state, world, slots, x, y, heading))
    return _pack_hits(hits)


@compiled
def _scan_region(model: MiniWorldModel, state: State, world: int, region: int, lane: int) -> int:
    """Return what an agent senses of a region, as bits.

    Most regions can be reached from one image only, whose position is already computed.
    """
    heading = int(get(state.heading, 0, lane))
    if model.images[region] == 1:
        x = get(state.image_x, region, lane)
        y = get(state.image_y, region, lane)
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
def sense_items(model: MiniWorldModel, state: State, world: int, agent: int, kind: int) -> int:
    """Return the sectors with items of a kind, as bits. `kind` is the number of the kind.

    Set `alert` if an item is near enough to be touched after the next move.
    """
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
    def sense(part: Any, model: MiniWorldModel, state: State, world: int, agent: int) -> int:
        return sense_items(model, state, world, agent, 0)

    @staticmethod
    def oracle(part: Any, agent: Any, items: Any, naive: Any) -> Any:
        return naive.visible_sectors(agent, [item for item in items if item.kind == FOOD])


def _sense_all(senses: Any, model: Any, state: Any, world: int, agent: int) -> int:
    """Return the bits of all senses. The first sense has the lowest bits."""
    code = 0
    first = 0
    for sense_part in senses:
        code |= sense(sense_part, model, state, world, agent) << first
        first += len(type(sense_part).part.inputs)
    return code


def _choose_sense_all(senses: Any, model: Any, state: Any, world: Any, agent: Any) -> Any:
    if len(senses) == 1:
        return lambda senses, model, state, world, agent: sense(
            senses[0], model, state, world, agent
        )
    count = len(part_class(senses[0]).inputs)
    return lambda senses, model, state, world, agent: (
        sense(senses[0], model, state, world, agent)
        | (sense_all(senses[1:], model, state, world, agent) << count)
    )


sense_all = register(_sense_all, _choose_sense_all)


@compiled
def _write_bits(
    sense_part: Any, count: int, model: Any, state: Any, world: int, agent: int, first: int
) -> None:
    code = sense(sense_part, model, state, world, agent)
    for k in range(count):
        state.activations[first + k, world * model.agents + agent] = np.float32((code >> k) & 1)


def _write_inputs(senses: Any, model: Any, state: Any, world: int, agent: int, first: int) -> None:
    """Set the inputs of an agent from the row `first` on."""
    for sense_part in senses:
        if type(sense_part).part.is_continuous:
            measure(sense_part, model, state, world, agent, first)
        else:
            _write_bits(
                sense_part, len(type(sense_part).part.inputs), model, state, world, agent, first
            )
        first += len(type(sense_part).part.inputs)


def _choose_write_inputs(
    senses: Any, model: Any, state: Any, world: Any, agent: Any, first: Any
) -> Any:
    if len(senses) == 0:
        return lambda senses, model, state, world, agent, first: None
    part = part_class(senses[0])
    count = len(part.inputs)
    is_continuous = part.is_continuous

    def write(senses: Any, model: Any, state: Any, world: int, agent: int, first: int) -> None:
        if is_continuous:
            measure(senses[0], model, state, world, agent, first)
        else:
            _write_bits(senses[0], count, model, state, world, agent, first)
        write_inputs(senses[1:], model, state, world, agent, first + count)

    return write


write_inputs = register(_write_inputs, _choose_write_inputs)


@compiled
def _set_continuous_inputs(
    senses: Any, model: MiniWorldModel, state: State, world: int, agent: int
) -> None:
    """Set the inputs of an agent, some of them real-valued. Nothing is looked up."""
    write_inputs(senses, model, state, world, agent, 0)
    state.code[0, world * model.agents + agent] = 0


@compiled
def _set_binary_inputs(
    senses: Any, model: MiniWorldModel, state: State, world: int, agent: int
) -> None:
    """Set the inputs of an agent, and look up the outputs that follow from them.

    Unchanged inputs are written, too: a mispredicted branch costs more than the write.
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
def list_near_agents(model: MiniWorldModel, state: State, world: int, first: int, last: int) -> int:
    """List the agents with `near` above 0 in `near_agents`, and return their number.

    The range is `first` to `last` - 1. Every agent is written, and the next one overwrites an agent
    that is not near: a branch per agent would be mispredicted often.
    """
    count = 0
    for agent in range(first, last):
        put(state.near_agents, 0, world * model.agents + first + count, agent)
        count += int(get(state.near, 0, world * model.agents + agent) != ZERO)
    return count


@compiled
def perceive(model: MiniWorldModel, state: State, world: int, agent: int) -> None:
    """Set the inputs of an agent with its senses."""
    lane = world * model.agents + agent
    put(state.alert, 0, lane, model.always_alert)
    _set_inputs(state.senses, model, state, world, agent)
