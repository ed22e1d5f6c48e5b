"""Positions of items, search for the items near an agent, and eating.

The items of a large region are sorted by grid cell. An agent tests only the cells in reach.
A *slot* is an entry of the arrays of sorted items. The items of neighboring cells in a row have
contiguous slots, and are tested as SIMD blocks. A region with few items is a single cell, in which
an item keeps the same slot. An empty SIMD block follows the slots of each region, so that a block
never contains items of two regions.

Agents eat one after another (`eat_items`). On several threads or on a GPU, all agents claim the
items that they touch. After a barrier, an item is eaten by the agent with the highest claim
(`contend`). The results are equal.

Source: Le (2019), "The Simulated World of Foods and Agents".
`docs/explanation/model.md` lists the choices that the paper leaves open.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import hook
from baldwinlab.engine.rng import FOOD, philox, unit
from baldwinlab.engine.simd import (
    HALF,
    ONE,
    WIDTH,
    ZERO,
    Lane,
    Mask,
    Value,
    any_of,
    choose,
    get,
    lanes_in_block,
    put,
    simd_block,
)
from baldwinlab.models.miniworld.map import is_placement_blocked, wrap_position
from baldwinlab.models.miniworld.population import eats_region
from baldwinlab.models.miniworld.state import MiniWorldModel, State

# Maximum number of attempts to find an allowed position. The last attempt ignores features.
MAX_ATTEMPTS = 100_000
# Upper bound of the distance of contact, in reaches: the diagonal of a square is 1.41 reaches.
MAX_CONTACT_PER_REACH = np.float32(1.5)


@compiled
def has_single_cell(model: MiniWorldModel, region: int) -> bool:
    """Return whether a region is a single cell. The items of such a region are not sorted."""
    return bool(model.region_cells[region + 1] - model.region_cells[region] == 1)


@compiled
def find_slots(model: MiniWorldModel, region: int) -> tuple[int, int]:
    """Return the first slot of a region, and the end: the slot after the last item."""
    # An empty SIMD block precedes the slots of each region except region 0.
    padding = region * WIDTH
    first_slot = model.region_items[region] + padding
    end_slot = model.region_items[region + 1] + padding
    return first_slot, end_slot


@compiled
def place_item(model: MiniWorldModel, state: State, world: int, region: int, item: int) -> None:
    """Draw the next position of an item: uniform in the region, where no feature blocks items."""
    seed = state.keys[world, 0]
    run = state.keys[world, 1]
    left = model.regions[region, 0]
    width = model.regions[region, 1]
    upper = model.regions[region, 2]
    height = model.regions[region, 3]
    x = ZERO
    y = ZERO
    attempts_left = MAX_ATTEMPTS
    while attempts_left > 0:
        words = philox(state.appearances[world, item], item, state.generation[0], FOOD, seed, run)
        x = wrap_position(left + width * unit(words[0]), model.width)
        y = wrap_position(upper + height * unit(words[1]), model.height)
        state.appearances[world, item] += 1
        is_blocked = is_placement_blocked(state.features, model, x, y)
        attempts_left = attempts_left - 1 if is_blocked else 0
    state.item_x[world, item] = x
    state.item_y[world, item] = y
    if has_single_cell(model, region):
        slot = item + region * WIDTH
        state.slot_x[world, slot] = x
        state.slot_y[world, slot] = y
    else:
        state.stale[world, region] = 1


@compiled
def assign_cells(
    model: MiniWorldModel, state: State, world: int, region: int, items: tuple[int, int]
) -> None:
    """Set `state.item_cell` of the items `items[0]` to `items[1]` - 1 of a region."""
    left = model.regions[region, 0]
    upper = model.regions[region, 2]
    first_cell = model.region_cells[region]
    width = model.cell_size[region, 0]
    height = model.cell_size[region, 1]
    columns = model.grid[region, 0]
    rows = model.grid[region, 1]
    # The compiler vectorizes loops with `get`, but not with indices.
    for item in range(items[0], items[1]):
        column = np.int32((get(state.item_x, world, item) - left) / width)
        row = np.int32((get(state.item_y, world, item) - upper) / height)
        cell = first_cell + min(max(row, 0), rows - 1) * columns + min(max(column, 0), columns - 1)
        put(state.item_cell, world, item, cell)


@compiled
def sort_into_cells(model: MiniWorldModel, state: State, world: int, region: int) -> None:
    """Sort the items of a region by cell, with a counting sort."""
    first_item = model.region_items[region]
    end_item = model.region_items[region + 1]
    first_cell = model.region_cells[region]
    end_cell = model.region_cells[region + 1]
    for cell in range(first_cell, end_cell):
        state.cell_next[world, cell] = 0
    assign_cells(model, state, world, region, (first_item, end_item))
    for item in range(first_item, end_item):
        cell = get(state.item_cell, world, item)
        put(state.cell_next, world, cell, get(state.cell_next, world, cell) + 1)
    slot = first_item + region * WIDTH
    for cell in range(first_cell, end_cell):
        count = state.cell_next[world, cell]
        state.cell_slots[world, cell + region] = slot
        state.cell_next[world, cell] = slot
        slot += count
    state.cell_slots[world, end_cell + region] = slot
    for item in range(first_item, end_item):
        cell = get(state.item_cell, world, item)
        slot = get(state.cell_next, world, cell)
        put(state.cell_next, world, cell, slot + 1)
        put(state.slot_x, world, slot, get(state.item_x, world, item))
        put(state.slot_y, world, slot, get(state.item_y, world, item))
        put(state.slot_item, world, slot, item)
    state.stale[world, region] = 0


@compiled
def position_in_image(
    model: MiniWorldModel, region: int, number: int, x: np.float32, y: np.float32
) -> tuple[np.float32, np.float32]:
    """Return the coordinates of a position in the image `number` of the torus.

    If agents reach the region from one image only, return the coordinates nearest to the region.
    """
    if model.images[region] == 1:
        center_x = model.regions[region, 0] + model.regions[region, 1] * HALF
        center_y = model.regions[region, 2] + model.regions[region, 3] * HALF
        return nearest_image(x, center_x, model.width), nearest_image(y, center_y, model.height)
    # The nine images are numbered by rows, from the upper left.
    columns_right = np.float32(number % 3 - 1)
    rows_down = np.float32(number // 3 - 1)
    return x + columns_right * model.width, y + rows_down * model.height


@compiled
def nearest_image(position: Value, center: np.float32, span: np.float32) -> Value:
    """Return `position`, `position + span` or `position - span`: the value nearest to `center`."""
    half = span * HALF
    position = choose(center - position > half, position + span, position)
    return choose(center - position < -half, position - span, position)


@compiled
def find_cells_within(
    model: MiniWorldModel, region: int, axis: int, position: np.float32, radius: np.float32
) -> tuple[int, int]:
    """Return the first column (axis 0) or row (axis 1) of cells within `radius`, and the end.

    The end is the index after the last column or row. Both are 0 if the region is out of reach.
    """
    if model.grid[region, axis] == 1 and model.images[region] == 1:
        return 0, 1
    offset = position - model.regions[region, 2 * axis]
    # One unit of length more than the radius covers rounding.
    reach = radius + ONE
    if offset + reach < ZERO or offset - reach > model.regions[region, 2 * axis + 1]:
        return 0, 0
    # `int` rounds toward 0, and is faster than `math.floor`, which would be a call.
    first = int((offset - reach) / model.cell_size[region, axis])
    last = int((offset + reach) / model.cell_size[region, axis])
    return max(first, 0), min(last + 1, model.grid[region, axis])


@compiled
def find_slots_in_row(
    model: MiniWorldModel, state: State, world: int, region: int, row: int, columns: tuple[int, int]
) -> tuple[int, int]:
    """Return the first slot of the cells in a row of the grid, and the slot after the last item."""
    # `cell_slots` has an entry after the last cell of each earlier region, so `region` is added.
    cell = model.region_cells[region] + region + row * model.grid[region, 0]
    first_slot = get(state.cell_slots, world, cell + columns[0])
    end_slot = get(state.cell_slots, world, cell + columns[1])
    return first_slot, end_slot


@compiled
def is_touching(
    model: MiniWorldModel, state: State, world: int, slot: Lane, x: np.float32, y: np.float32
) -> Mask:
    """Return whether a body at (x, y) touches the item in a slot (interpretation R2)."""
    dx = get(state.slot_x, world, slot) - x
    dy = get(state.slot_y, world, slot) - y
    if model.square_contact:
        return (abs(dx) < model.reach) & (abs(dy) < model.reach)
    return dx * dx + dy * dy < model.reach * model.reach


@compiled
def _eat_in_region(
    model: MiniWorldModel,
    state: State,
    world: int,
    region: int,
    lane: int,
    step: int,
    x: np.float32,
    y: np.float32,
) -> None:
    """Eat the items of a region that a body at (x, y) touches."""
    radius = MAX_CONTACT_PER_REACH * model.reach
    columns = find_cells_within(model, region, 0, x, radius)
    first_row, end_row = find_cells_within(model, region, 1, y, radius)
    for row in range(first_row, end_row):
        first_slot, end_slot = find_slots_in_row(model, state, world, region, row, columns)
        for first in range(first_slot, end_slot, lanes_in_block()):
            if any_of(is_touching(model, state, world, simd_block(first), x, y)):
                for slot in range(first, min(first + lanes_in_block(), end_slot)):
                    item = state.slot_item[world, slot]
                    # An item can be eaten once per step, and already has its next position.
                    is_uneaten = state.touched[world, item] != step
                    if is_uneaten and is_touching(model, state, world, slot, x, y):
                        state.eaten_in_life[region, lane] += 1
                        state.touched[world, item] = step
                        place_item(model, state, world, region, item)


@compiled
def eat_items(model: MiniWorldModel, state: State, world: int, agent: int, step: int) -> None:
    """Eat every item that the agent touches, unless the item was eaten earlier in this step.

    An eaten item immediately gets a new position.
    """
    lane = world * model.agents + agent
    if get(state.alert, 0, lane) == 0:
        return
    for region in range(model.regions.shape[0]):
        is_eaten = eats_region(state.population, region)
        for number in range(model.images[region] if is_eaten else 0):
            x, y = position_in_image(
                model, region, number, state.positions[0, lane], state.positions[1, lane]
            )
            _eat_in_region(model, state, world, region, lane, step, x, y)


@compiled
def resort_stale_cells(model: MiniWorldModel, state: State, world: int) -> None:
    """Sort the regions with items that have moved since the last sorting."""
    for region in range(model.regions.shape[0]):
        if state.stale[world, region] != 0:
            sort_into_cells(model, state, world, region)


@hook
def raise_claim(agents: Any, world: int, item: int, claim: int) -> None:
    """Set `agents.claims[world, item]` to at least `claim`, in one atomic operation."""


@compiled
def init_item(
    claims: Any, model: MiniWorldModel, state: State, world: int, region: int, item: int
) -> None:
    """At the start of a lifetime: place an item, and mark it as not claimed (-1) and not eaten."""
    claims[world, item] = -1
    state.touched[world, item] = -1
    state.appearances[world, item] = 0
    place_item(model, state, world, region, item)


@compiled
def contend(
    agents: Any, model: MiniWorldModel, state: State, agent: int, step: int, is_eating: bool
) -> bool:
    """Claim the items that an agent touches. With `is_eating`, eat items with this agent's claim.

    Return whether the agent touches any item.
    """
    lane = agents.first_world * model.agents + agent
    # Number of agents that eat before this agent in this step.
    turn = agent - step % model.agents
    turn = turn + model.agents if turn < 0 else turn
    # A later step has higher claims. In a step, an earlier turn has a higher claim.
    claim = 2 * (step * model.agents + model.agents - 1 - turn)
    has_touched = False
    for region in range(model.regions.shape[0]):
        is_eaten = eats_region(state.population, region)
        for number in range(model.images[region] if is_eaten else 0):
            x, y = position_in_image(
                model, region, number, state.positions[0, lane], state.positions[1, lane]
            )
            has_touched |= _contend_in_region(
                agents, model, state, region, lane, step, x, y, claim, is_eating
            )
    return has_touched


@compiled
def _contend_in_region(
    agents: Any,
    model: MiniWorldModel,
    state: State,
    region: int,
    lane: int,
    step: int,
    x: np.float32,
    y: np.float32,
    claim: int,
    is_eating: bool,
) -> bool:
    """Call `contend` for the items of one region, with a body at (x, y)."""
    world = agents.first_world
    has_touched = False
    radius = MAX_CONTACT_PER_REACH * model.reach
    columns = find_cells_within(model, region, 0, x, radius)
    first_row, end_row = find_cells_within(model, region, 1, y, radius)
    for row in range(first_row, end_row):
        first_slot, end_slot = find_slots_in_row(model, state, world, region, row, columns)
        for first in range(first_slot, end_slot, lanes_in_block()):
            if any_of(is_touching(model, state, world, simd_block(first), x, y)):
                for slot in range(first, min(first + lanes_in_block(), end_slot)):
                    if is_touching(model, state, world, slot, x, y):
                        has_touched = True
                        item = state.slot_item[world, slot]
                        if not is_eating:
                            raise_claim(agents, world, item, claim)
                        elif agents.claims[world, item] == claim:
                            # Claims are even. The odd value marks the item as eaten.
                            agents.claims[world, item] = claim + 1
                            state.eaten_in_life[region, lane] += 1
                            state.touched[world, item] = step
                            place_item(model, state, world, region, item)
    return has_touched
