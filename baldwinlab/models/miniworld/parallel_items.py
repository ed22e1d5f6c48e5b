"""Items of a world that a team of threads simulates: eating with claims, and sorting into cells.

The results are those of `items.py`.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.engine.atomics import Team, prefetch, share_of_thread, wait_for_team
from baldwinlab.engine.jit import compiled
from baldwinlab.engine.simd import HALF, WIDTH, get, put
from baldwinlab.models.miniworld.contention import contend, init_item
from baldwinlab.models.miniworld.items import (
    assign_cells,
    find_cells_within,
    find_slots,
    find_slots_in_row,
    has_single_cell,
    sort_into_cells,
)
from baldwinlab.models.miniworld.state import MiniWorldModel, State

# Minimum number of items of a region that all threads sort together. Each thread sorts some of the
# smaller regions.
MIN_SHARED_ITEMS: Final = 4096
# Number of SIMD blocks of a row of cells that are loaded before a scan. Few rows have more.
PREFETCHED_BLOCKS: Final = 2
# Bit of `State.alert` of an agent that has claimed an item in this step.
_CLAIM_BIT: Final = 16
# The only world of the batch.
_WORLD: Final = 0


class SharedArrays(NamedTuple):
    """A thread of a team, and the arrays that the team shares."""

    team: Team
    # Scratch: number of items of a thread in a cell, then their next slot, [thread, cell].
    counts: npt.NDArray[np.int32]
    totals: npt.NDArray[np.int64]  # Scratch: number of items in the cells of a thread, [thread].


@compiled
def claim_items(agents: Any, model: MiniWorldModel, state: State, step: int) -> None:
    """Let the agents of a range claim the items that they touch."""
    for agent in range(agents.first_agent, agents.end_agent):
        alert = get(state.alert, 0, agent)
        if alert != 0 and contend(agents, model, state, agent, step, False):
            put(state.alert, 0, agent, alert | _CLAIM_BIT)


@compiled
def eat_claimed_items(agents: Any, model: MiniWorldModel, state: State, step: int) -> None:
    """Let the agents of a range eat the items of which they have the highest claim."""
    for agent in range(agents.first_agent, agents.end_agent):
        alert = get(state.alert, 0, agent)
        if alert & _CLAIM_BIT != 0:
            put(state.alert, 0, agent, alert & ~_CLAIM_BIT)
            contend(agents, model, state, agent, step, True)


@compiled
def prefetch_items(model: MiniWorldModel, state: State, agents: tuple[int, int]) -> None:
    """Load the items in sorted regions near the agents of a range into the cache.

    The agents are at random positions, so a scan would wait for the memory of each row of cells.
    """
    radius = max(model.visual_radius, model.alert_radius)
    for region in range(model.regions.shape[0]):
        is_sorted = not has_single_cell(model, region)
        has_one_image = model.images[region] == 1
        for agent in range(agents[0], agents[1] if is_sorted and has_one_image else agents[0]):
            if get(state.near, 0, agent) > HALF:
                columns = find_cells_within(
                    model, region, 0, get(state.image_x, region, agent), radius
                )
                first_row, end_row = find_cells_within(
                    model, region, 1, get(state.image_y, region, agent), radius
                )
                for row in range(first_row, end_row):
                    first_slot, _ = find_slots_in_row(model, state, _WORLD, region, row, columns)
                    # A loop to the last slot would be mispredicted.
                    for block in range(PREFETCHED_BLOCKS):
                        prefetch(state.slot_x, _WORLD, first_slot + block * WIDTH)
                        prefetch(state.slot_y, _WORLD, first_slot + block * WIDTH)


@compiled
def place_items(agents: Any, model: MiniWorldModel, state: State) -> None:
    """At the start of a lifetime: place the items of a thread."""
    for region in range(model.regions.shape[0]):
        first, end = share_of_thread(
            agents.shared.team, model.region_items[region], model.region_items[region + 1]
        )
        for item in range(first, end):
            init_item(agents.claims, model, state, _WORLD, region, item)


@compiled
def sort_regions(shared: SharedArrays, model: MiniWorldModel, state: State, is_start: bool) -> None:
    """Sort the regions whose items have moved, or all regions at the start of a lifetime."""
    team = shared.team
    for region in range(model.regions.shape[0]):
        items = model.region_items[region + 1] - model.region_items[region]
        is_shared = items >= MIN_SHARED_ITEMS
        is_sorted_here = is_shared or region % team.threads == team.thread
        if is_sorted_here and (is_start or state.stale[_WORLD, region] != 0):
            if is_shared:
                _sort_together(shared, model, state, region)
            else:
                sort_into_cells(model, state, _WORLD, region)


@compiled
def _sort_together(shared: SharedArrays, model: MiniWorldModel, state: State, region: int) -> None:
    """Sort the items of a region by cell, as `sort_into_cells`, with all threads of a team."""
    team = shared.team
    counts = shared.counts
    items = share_of_thread(team, model.region_items[region], model.region_items[region + 1])
    first_cell = model.region_cells[region]
    end_cell = model.region_cells[region + 1]
    for cell in range(first_cell, end_cell):
        counts[team.thread, cell] = 0
    assign_cells(model, state, _WORLD, region, items)
    for item in range(items[0], items[1]):
        cell = get(state.item_cell, _WORLD, item)
        put(counts, team.thread, cell, get(counts, team.thread, cell) + 1)
    wait_for_team(team)
    state.stale[_WORLD, region] = 0
    _assign_slots(shared, model, state, region, share_of_thread(team, first_cell, end_cell))
    wait_for_team(team)
    for item in range(items[0], items[1]):
        cell = get(state.item_cell, _WORLD, item)
        slot = get(counts, team.thread, cell)
        put(counts, team.thread, cell, slot + 1)
        put(state.slot_x, _WORLD, slot, get(state.item_x, _WORLD, item))
        put(state.slot_y, _WORLD, slot, get(state.item_y, _WORLD, item))
        put(state.slot_item, _WORLD, slot, item)


@compiled
def _assign_slots(
    shared: SharedArrays, model: MiniWorldModel, state: State, region: int, cells: tuple[int, int]
) -> None:
    """Set the first slots of the cells of a thread, and of the items of each thread in a cell."""
    team = shared.team
    counts = shared.counts
    total = 0
    for thread in range(team.threads):
        for cell in range(cells[0], cells[1]):
            total += get(counts, thread, cell)
    shared.totals[team.thread] = total
    wait_for_team(team)
    slot, _ = find_slots(model, region)
    for thread in range(team.thread):
        slot += shared.totals[thread]
    for cell in range(cells[0], cells[1]):
        put(state.cell_slots, _WORLD, cell + region, slot)
        for thread in range(team.threads):
            count = get(counts, thread, cell)
            put(counts, thread, cell, slot)
            slot += count
    if team.thread == team.threads - 1:
        put(state.cell_slots, _WORLD, cells[1] + region, slot)
