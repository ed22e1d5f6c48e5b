"""Steps of a large world, which a team of threads simulates. The results are those of `step.py`.

`cpu.py` starts the threads. A thread simulates all phases of a step for a *tile*, a group of lanes,
before the next tile, so that the arrays of a tile remain in the cache. The threads wait for each
other before and after items change, and around hooks that read other agents.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.engine.atomics import Team, atomic_max, prefetch, share_of_thread, wait_for_team
from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import hook, make_part_type
from baldwinlab.engine.reference import as_pointer
from baldwinlab.engine.simd import HALF, WIDTH, ZERO, Lane, get, lanes_in_block, put, simd_block
from baldwinlab.models.miniworld.birth import init_agent_state, init_features
from baldwinlab.models.miniworld.items import (
    assign_cells,
    contend,
    find_cells_within,
    find_slots,
    find_slots_in_row,
    has_single_cell,
    init_item,
    sort_into_cells,
)
from baldwinlab.models.miniworld.learning.control import init_control
from baldwinlab.models.miniworld.lookup import fill_table
from baldwinlab.models.miniworld.map import place_newborn
from baldwinlab.models.miniworld.population import agent_number
from baldwinlab.models.miniworld.state import MiniWorldModel, State
from baldwinlab.models.miniworld.step import (
    CONTENDING_AGENTS,
    end_step_of_features,
    observe_others_per_world,
    prepare_all_senses,
    take_step,
    wait_for_agents,
)
from baldwinlab.parts.learning_rules import init_agent, load_genes, observe_others

# Minimum number of items of a region that all threads sort together. A single thread sorts a
# smaller region.
MIN_SHARED_ITEMS: Final = 4096
# Number of SIMD blocks of a row of cells that are loaded before a scan. Few rows have more blocks.
PREFETCHED_BLOCKS: Final = 2
# Bit of `State.alert` of an agent that has claimed an item in this step.
_CLAIM_BIT: Final = 16
# Number of lanes in a tile. The weights and activations of a tile fit the second-level cache.
TILE_LANES: Final = 16 * WIDTH
# The only world of the batch.
_WORLD: Final = 0


class SharedArrays(NamedTuple):
    """A thread of a team, and the arrays that the team shares."""

    team: Team
    # Scratch [thread, cell]: number of items of a thread in a cell, then the next slot of an item.
    counts: npt.NDArray[np.int32]
    totals: npt.NDArray[np.int64]  # Scratch [thread]: number of items in the cells of a thread.


@compiled
def claim_items(agents: Any, model: MiniWorldModel, state: State, step: int) -> None:
    """Let the agents of a range claim the items that they touch."""
    for agent in range(agents.first_agent, agents.end_agent):
        alert = get(state.alert, 0, agent)
        if alert != 0 and contend(agents, model, state, agent, step, False):
            put(state.alert, 0, agent, alert | _CLAIM_BIT)


@compiled
def eat_claimed_items(agents: Any, model: MiniWorldModel, state: State, step: int) -> None:
    """Let each agent of a range eat the items for which this agent has the highest claim."""
    for agent in range(agents.first_agent, agents.end_agent):
        alert = get(state.alert, 0, agent)
        if alert & _CLAIM_BIT != 0:
            put(state.alert, 0, agent, alert & ~_CLAIM_BIT)
            contend(agents, model, state, agent, step, True)


@compiled
def prefetch_items(model: MiniWorldModel, state: State, agents: tuple[int, int]) -> None:
    """Load the items near the agents `agents[0]` to `agents[1]` - 1 into the cache.

    The agents are at random positions, so a scan would wait for the memory of each row of cells.
    """
    radius = max(model.visual_radius, model.alert_radius)
    for region in range(model.regions.shape[0]):
        is_sorted = not has_single_cell(model, region)
        has_one_image = model.images[region] == 1
        # The range is empty for other regions, which are small or need several scans.
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
                    # The processor would mispredict the end of a loop over all slots.
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
    """Sort the regions with moved items, or all regions at the start of a lifetime."""
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
    # All threads have read `stale` before the barrier, and all set the same value.
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
    """Set the first slot of each cell in a range, and `counts` to the slots of the threads.

    In a cell, the items of a thread follow the items of earlier threads, as in `sort_into_cells`.
    """
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
    # The last thread also sets the end of the last cell.
    if team.thread == team.threads - 1:
        put(state.cell_slots, _WORLD, cells[1] + region, slot)


@hook
def select_tile(agents: Any, model: MiniWorldModel, first_lane: int) -> Any:
    """Return the ranges of the tile that starts at a lane, with the type of `agents`."""
    return agents


class _IndependentAgents:
    """Hooks for agents, if no part reads other agents. A thread divides its lanes into tiles."""

    observe_others_per_world = staticmethod(observe_others_per_world.default)
    wait_for_agents = staticmethod(wait_for_agents.default)

    @staticmethod
    def lane_of(agents: Any, first: int) -> Lane:
        return simd_block(first)

    @staticmethod
    def prepare_senses_per_world(
        agents: Any, model: MiniWorldModel, state: State, step: int
    ) -> None:
        """Load the items near the agents into the cache. No sense has a hook `prepare_senses`."""
        prefetch_items(model, state, (agents.first_agent, agents.end_agent))

    @staticmethod
    def eat_all(agents: Any, model: MiniWorldModel, state: State, step: int) -> None:
        """Claim the items. `eat_claimed_items` follows after all threads have claimed."""
        claim_items(agents, model, state, step)

    @staticmethod
    def raise_claim(agents: Any, world: int, item: int, claim: int) -> None:
        atomic_max(agents.claims[world], item, claim)

    @staticmethod
    def select_tile(agents: Any, model: MiniWorldModel, first_lane: int) -> Any:
        end_lane = min(first_lane + TILE_LANES, agents.end_lane)
        return IndependentAgents(
            first_lane=first_lane,
            end_lane=end_lane,
            lanes_per_block=agents.lanes_per_block,
            first_world=agents.first_world,
            end_world=agents.end_world,
            first_agent=min(first_lane, model.agents),
            end_agent=min(end_lane, model.agents),
            claims=agents.claims,
            shared=agents.shared,
        )


class _DependentAgents(_IndependentAgents):
    """Hooks for agents, if a part reads other agents. All lanes of a thread are one tile."""

    select_tile = staticmethod(select_tile.default)

    @staticmethod
    def prepare_senses_per_world(
        agents: Any, model: MiniWorldModel, state: State, step: int
    ) -> None:
        wait_for_team(agents.shared.team)
        if agents.shared.team.thread == 0:
            prepare_all_senses(state.senses, model, state, _WORLD, step)
        wait_for_team(agents.shared.team)

    @staticmethod
    def observe_others_per_world(
        agents: Any, model: MiniWorldModel, state: State, step: int
    ) -> None:
        wait_for_team(agents.shared.team)
        if agents.shared.team.thread == 0:
            observe_others(state.rule, model, state, _WORLD, step)
        wait_for_team(agents.shared.team)

    @staticmethod
    def wait_for_agents(agents: Any) -> None:
        wait_for_team(agents.shared.team)


# The field `shared` is a `SharedArrays`.
IndependentAgents = make_part_type(_IndependentAgents, (*CONTENDING_AGENTS, "shared"))
DependentAgents = make_part_type(_DependentAgents, (*CONTENDING_AGENTS, "shared"))


@compiled
def _init_agents(agents: Any, model: MiniWorldModel, state: State) -> None:
    """Initialize the agents and items of a thread at the start of a lifetime."""
    team = agents.shared.team
    for unit in range(state.activations.shape[0]):
        for lane in range(agents.first_lane, agents.end_lane):
            state.activations[unit, lane] = ZERO
    for agent in range(agents.first_agent, agents.end_agent):
        init_agent_state(model, state, _WORLD, agent)
    for first in range(agents.first_lane, agents.end_lane, lanes_in_block()):
        load_genes(state.rule, model, state, state.genes, simd_block(first))
    wait_for_team(team)
    if team.thread == 0:
        init_features(state.features, model, state, _WORLD)
    wait_for_team(team)
    for agent in range(agents.first_agent, agents.end_agent):
        place_newborn(model, state, _WORLD, agent, agent_number(state.population, agent))
        init_agent(state.rule, model, state, _WORLD, agent)
        init_control(state.control, model, state, _WORLD, agent)
    place_items(agents, model, state)
    wait_for_team(team)
    is_start = True
    sort_regions(agents.shared, model, state, is_start)
    for first in range(agents.first_lane, agents.end_lane, lanes_in_block()):
        fill_table(state.lookup, model, state, state.genes, simd_block(first))
    wait_for_team(team)


@compiled
def _prefetch_weights(tile: Any, state: State) -> None:
    """Load the weights of a tile into the cache. The processor cannot predict these accesses."""
    for weight in range(state.weights.shape[0]):
        for lane in range(tile.first_lane, tile.end_lane, WIDTH):
            prefetch(state.weights, weight, lane)


@compiled
def _take_team_step(agents: Any, model: MiniWorldModel, state: State, step: int) -> None:
    """Let the agents of a thread take a step, and sort the items together with other threads."""
    team = agents.shared.team
    tile = select_tile(agents, model, agents.first_lane)
    _prefetch_weights(tile, state)
    take_step(tile, model, state, step)
    while tile.end_lane < agents.end_lane:
        tile = select_tile(agents, model, tile.end_lane)
        _prefetch_weights(tile, state)
        take_step(tile, model, state, step)
    wait_for_team(team)
    eat_claimed_items(agents, model, state, step)
    wait_for_team(team)
    is_start = False
    sort_regions(agents.shared, model, state, is_start)
    wait_for_team(team)
    if team.thread == 0:
        end_step_of_features(state.features, model, state, _WORLD, step)
        end_step_of_features(state.recorders, model, state, _WORLD, step)
    wait_for_team(team)


def simulate_in_team(
    agents: Any,
    model: MiniWorldModel,
    state: State,
    is_start: bool,
    first_step: int,
    last_step: int,
) -> None:
    """Simulate the steps from `first_step` to `last_step` - 1 for the agents of a thread.

    All threads of a team call this function. If `is_start`, initialize the generation first.
    """
    model = as_pointer(model)
    state = as_pointer(state)
    if is_start:
        _init_agents(agents, model, state)
    for step in range(first_step, last_step):
        _take_team_step(agents, model, state, step)
