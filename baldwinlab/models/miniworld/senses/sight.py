"""Sight of items of a kind: three binary sensors, left, front and right.

u and v are the coordinates of an item along and across the heading. v is positive to the right.
An item is in the front sector if |v| <= u tan 15, and in a side sector if u tan 15 < |v| < u.
These tests need no angle of the item.

Source: Le (2019), "The Simulated World of Foods and Agents", on the angle theta.
`docs/explanation/model.md` describes the boundaries of the sectors (interpretation R8).
"""

from __future__ import annotations

import math
from typing import Any, ClassVar, Final

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import for_each, select_by_type
from baldwinlab.engine.simd import (
    HALF,
    INFINITY,
    ONE,
    ZERO,
    Lane,
    Mask,
    Value,
    any_of,
    choose,
    fill_lanes,
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
    position_in_image,
)
from baldwinlab.models.miniworld.map import combine_masks
from baldwinlab.models.miniworld.state import FOOD, MiniWorldModel, State
from baldwinlab.parts.senses import Sense
from baldwinlab.parts.world_features import LineOfSight, blocks_sight

Sectors = tuple[tuple[float, float] | None, ...]
# Left, front and right, in degrees clockwise from the heading.
SECTORS: Final[Sectors] = ((315, 345), (345, 15), (15, 45))
TAN_15 = np.float32(math.tan(math.radians(15)))
# Bits of a scan: an item is in a sector, or so near that the next move can touch the item.
LEFT_BIT = 1
FRONT_BIT = 2
RIGHT_BIT = 4
ALERT_BIT = 8

# Four values, for each lane of a SIMD block: the smallest v of an item in a side sector, or 0. The
# smallest |v| - u tan 15 of a visible item, or a positive number. The largest v of an item in a
# side sector, or 0. The smallest squared distance of an item. The values are not masks, because
# without AVX-512, a loop would convert masks in every round.
Hits = tuple[Value, Value, Value, Value]


@compiled
def _exclude_hidden(
    features: Any, model: MiniWorldModel, line: LineOfSight, in_range: Mask
) -> Mask:
    """Return the mask of the lanes in range that no feature hides."""
    return in_range & negated(is_hidden(features, model, line))


@compiled
def _exclude_nothing(
    features: Any, model: MiniWorldModel, line: LineOfSight, in_range: Mask
) -> Mask:
    """Return `in_range`, for experiments without world features."""
    return in_range


# Return whether any feature blocks sight.
is_hidden = for_each(blocks_sight, False, combine_masks)
# Return the mask of the lanes in range that the agent sees.
select_visible = select_by_type(_exclude_hidden, _exclude_nothing)


@compiled
def is_within_sight(model: MiniWorldModel, state: State, line: LineOfSight) -> Mask:
    """Return whether an agent sees an item or agent: in range, and not behind a wall.

    Parameters
    ----------
    model : MiniWorldModel
        Constants of the lifetime. Read only.
    state : State
        Arrays that a step changes, and the compiled parts.
    line : LineOfSight
        The line from the agent to the item or other agent.

    Returns
    -------
    bool, or a mask
        True if the distance is at most `model.visual_radius` and no feature blocks sight.
    """
    squared_distance = line.dx * line.dx + line.dy * line.dy
    in_range = squared_distance <= model.visual_radius * model.visual_radius
    return select_visible(state.features, model, line, in_range)


@compiled
def rotate_to_heading(
    model: MiniWorldModel, dx: Value, dy: Value, heading: int
) -> tuple[Value, Value]:
    """Return u and v: the coordinates of (dx, dy) along and across a heading."""
    u = dx * model.cosine[heading] + dy * model.sine[heading]
    v = dy * model.cosine[heading] - dx * model.sine[heading]
    return u, v


@compiled
def test_sectors(
    model: MiniWorldModel, state: State, line: LineOfSight, heading: int
) -> tuple[Mask, Mask, Mask]:
    """Return whether the end of a line is in the left, front and right sector."""
    u, v = rotate_to_heading(model, line.dx, line.dy, heading)
    sector_edge = u * TAN_15
    across = abs(v)
    visible = is_within_sight(model, state, line)
    front = visible & ((across < sector_edge) if model.open_boundaries else (across <= sector_edge))
    side = visible & (across > sector_edge) & (across < u)
    return side & (v < ZERO), front, side & (v > ZERO)


@compiled
def pack_sectors(left: Mask, front: Mask, right: Mask) -> int:
    """Return the sum of the bits of the sectors that contain an item: 1 left, 2 front, 4 right."""
    return (
        LEFT_BIT * int(any_of(left))
        | FRONT_BIT * int(any_of(front))
        | RIGHT_BIT * int(any_of(right))
    )


@compiled
def _smaller(first: Value, second: Value) -> Value:
    """Return the smaller of two values."""
    return choose(first < second, first, second)


@compiled
def _no_hits() -> Hits:
    """Return the hits before the first item is tested."""
    block = simd_block(0)
    return (
        fill_lanes(block, ZERO),
        fill_lanes(block, ONE),
        fill_lanes(block, ZERO),
        fill_lanes(block, INFINITY),
    )


@compiled
def _pack_hits(model: MiniWorldModel, hits: Hits) -> int:
    """Return the bits of the sectors with items, and `ALERT_BIT` if an item is near."""
    leftmost, front, rightmost, nearest = hits
    is_front = front < ZERO if model.open_boundaries else front <= ZERO
    is_near = nearest <= model.alert_radius * model.alert_radius
    sectors = pack_sectors(leftmost < ZERO, is_front, rightmost > ZERO)
    return sectors | ALERT_BIT * int(any_of(is_near))


@compiled
def _test_items(
    model: MiniWorldModel,
    state: State,
    world: int,
    slot: Lane,
    x: np.float32,
    y: np.float32,
    heading: int,
    hits: Hits,
) -> Hits:
    """Return `hits`, updated by the items in `slot`."""
    leftmost, front, rightmost, nearest = hits
    dx = get(state.slot_x, world, slot) - x
    dy = get(state.slot_y, world, slot) - y
    squared_distance = dx * dx + dy * dy
    u, v = rotate_to_heading(model, dx, dy, heading)
    # An item out of sight counts as an item behind the agent.
    is_visible = is_within_sight(model, state, LineOfSight(x, y, dx, dy))
    u = choose(is_visible, u, -ONE)
    across = abs(v)
    # Rounding does not change the sign of a difference.
    excess = across - u * TAN_15
    side_v = choose(_smaller(excess, u - across) > ZERO, v, ZERO)
    return (
        _smaller(side_v, leftmost),
        _smaller(excess, front),
        choose(side_v > rightmost, side_v, rightmost),
        _smaller(squared_distance, nearest),
    )


@compiled
def _test_slots(
    model: MiniWorldModel,
    state: State,
    world: int,
    slots: tuple[int, int],
    x: np.float32,
    y: np.float32,
    heading: int,
    hits: Hits,
) -> Hits:
    """Return `hits`, updated by the items of a range of slots.

    The last SIMD block can contain slots after the range. These contain items of the same region,
    or `NOWHERE`, so the tests of further slots are correct, too.
    """
    first_slot, end_slot = slots
    for first in range(first_slot, end_slot, lanes_in_block()):
        hits = _test_items(model, state, world, simd_block(first), x, y, heading, hits)
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
    """Return the bits of the items of a region that an agent at (x, y) senses.

    The bits are packed once, because packing takes as long as the test of a SIMD block.
    """
    radius = max(model.visual_radius, model.alert_radius)
    columns = find_cells_within(model, region, 0, x, radius)
    first_row, end_row = find_cells_within(model, region, 1, y, radius)
    has_no_cells = columns[0] == columns[1] or first_row == end_row
    if has_no_cells:
        return 0
    hits = _no_hits()
    for row in range(first_row, end_row):
        slots = find_slots_in_row(model, state, world, region, row, columns)
        hits = _test_slots(model, state, world, slots, x, y, heading, hits)
    return _pack_hits(model, hits)


@compiled
def _scan_region(model: MiniWorldModel, state: State, world: int, region: int, lane: int) -> int:
    """Return the bits of the items of a region that an agent senses.

    Agents reach most regions from one image only. `State.image_x` has the position in this image.
    """
    heading = int(get(state.heading, 0, lane))
    if model.images[region] == 1:
        x = get(state.image_x, region, lane)
        y = get(state.image_y, region, lane)
        if has_single_cell(model, region):
            slots = find_slots(model, region)
            hits = _test_slots(model, state, world, slots, x, y, heading, _no_hits())
            return _pack_hits(model, hits)
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
    """Return the sectors with items of a kind, as bits: 1 left, 2 front, 4 right.

    Set `state.alert` if an item is near enough to be touched after the next move.

    Parameters
    ----------
    model : MiniWorldModel
        Constants of the lifetime. Read only.
    state : State
        Arrays that a step changes, and the compiled parts.
    world, agent : int
        Indices of the world and of the agent in it.
    kind : int
        Number of the kind, see `kind_number`.

    Returns
    -------
    int
        Sum of the bits of the sectors that contain a visible item.
    """
    lane = world * model.agents + agent
    bits = 0
    is_near_items = get(state.near, 0, lane) > HALF
    for region in range(model.regions.shape[0] if is_near_items else 0):
        if model.region_kind[region] == kind:
            bits |= _scan_region(model, state, world, region, lane)
    put(state.alert, 0, lane, get(state.alert, 0, lane) | (bits & ALERT_BIT))
    return bits & (LEFT_BIT | FRONT_BIT | RIGHT_BIT)


class Sight(Sense, name="food"):
    """Three binary inputs: food in the left, front and right sector.

    References
    ----------
    Le 2019.
    """

    inputs: ClassVar[tuple[str, ...]] = ("left", "front", "right")
    sectors: ClassVar[Sectors] = SECTORS
    item_kind: ClassVar[str] = FOOD
    only_items: ClassVar[bool] = True

    @staticmethod
    def sense(part: Any, model: MiniWorldModel, state: State, world: int, agent: int) -> int:
        food_kind = 0
        return sense_items(model, state, world, agent, food_kind)
