"""Contention of agents that eat at the same time, on several threads or on a GPU.

All agents claim the items that they touch, and after a barrier, the agent with the highest claim of
an item eats it. The results are those of `eat_items`, by which agents eat one after another.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import hook
from baldwinlab.engine.simd import any_of, lanes_in_block, simd_block
from baldwinlab.models.miniworld.items import (
    MAX_CONTACT_PER_REACH,
    find_cells_within,
    find_slots_in_row,
    is_touching,
    place_item,
    position_in_image,
)
from baldwinlab.models.miniworld.population import eats_region
from baldwinlab.models.miniworld.state import MiniWorldModel, State


@hook
def raise_claim(agents: Any, world: int, item: int, claim: int) -> None:
    """Set `agents.claims[world, item]` to at least `claim`, in one operation of the machine."""


@compiled
def init_item(
    claims: Any, model: MiniWorldModel, state: State, world: int, region: int, item: int
) -> None:
    """At the start of a lifetime: place an item, which no agent has claimed or eaten."""
    claims[world, item] = -1
    state.touched[world, item] = -1
    state.appearances[world, item] = 0
    place_item(model, state, world, region, item)


@compiled
def contend(
    agents: Any, model: MiniWorldModel, state: State, agent: int, step: int, is_eating: bool
) -> bool:
    """Claim the items that an agent touches, or eat the items that it has claimed (`is_eating`).

    Return whether the agent touches any item.
    """
    lane = agents.first_world * model.agents + agent
    turn = agent - step % model.agents
    turn = turn + model.agents if turn < 0 else turn
    # Claims of later steps are higher. In a step, claims of earlier turns are higher.
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
    """Claim or eat the items of a region that a body at (x, y) touches. See `contend`."""
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
