"""Functions for world features: place or remove an item, and ask whether it is on the map or eaten.

Each change also sorts the items of the region, so that agents sense the changed item in the next
step. An absent item has the x coordinate `ABSENT_X` times the width of the map, where no agent can
sense or touch the item.
"""

from __future__ import annotations

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.simd import ZERO
from baldwinlab.models.miniworld.items import place_item, sort_into_cells
from baldwinlab.models.miniworld.state import MiniWorldModel, State

# x of an absent item, in widths of the map. No image of an agent is within sight of this position.
ABSENT_X = np.float32(-3)


@compiled
def place_item_at(
    model: MiniWorldModel,
    state: State,
    world: int,
    region: int,
    item: int,
    x: np.float32,
    y: np.float32,
) -> None:
    """Place an item of a region at a position.

    The call takes time proportional to the number of items in the region.

    Parameters
    ----------
    model : MiniWorldModel
        Constants of the lifetime. Read only.
    state : State
        Arrays that a step changes, and the compiled parts.
    world, region, item : int
        Indices of the world, of the region and of the item. The items of a region are
        `model.region_items[region]` to `model.region_items[region + 1] - 1`.
    x, y : float32
        Coordinates on the map, inside the region, in units of length.
    """
    state.item_x[world, item] = x
    state.item_y[world, item] = y
    sort_into_cells(model, state, world, region)


@compiled
def place_item_randomly(
    model: MiniWorldModel, state: State, world: int, region: int, item: int
) -> None:
    """Place an item at a uniform position of its region, where no feature blocks it.

    The item gets the same random position as after an agent has eaten the item.

    Parameters
    ----------
    model : MiniWorldModel
        Constants of the lifetime. Read only.
    state : State
        Arrays that a step changes, and the compiled parts.
    world, region, item : int
        Indices of the world, of the region and of the item.
    """
    place_item(model, state, world, region, item)
    sort_into_cells(model, state, world, region)


@compiled
def remove_item(model: MiniWorldModel, state: State, world: int, region: int, item: int) -> None:
    """Remove an item from the map. The y coordinate does not change.

    Parameters
    ----------
    model : MiniWorldModel
        Constants of the lifetime. Read only.
    state : State
        Arrays that a step changes, and the compiled parts.
    world, region, item : int
        Indices of the world, of the region and of the item.
    """
    place_item_at(
        model, state, world, region, item, ABSENT_X * model.width, state.item_y[world, item]
    )


@compiled
def is_on_map(state: State, world: int, item: int) -> bool:
    """Return whether an item is on the map.

    Parameters
    ----------
    state : State
        Arrays that a step changes, and the compiled parts.
    world, item : int
        Indices of the world and of the item.

    Returns
    -------
    bool
        False after `remove_item`.
    """
    return bool(state.item_x[world, item] >= ZERO)


@compiled
def was_eaten(state: State, world: int, item: int, step: int) -> bool:
    """Return whether an item was eaten in this step.

    An eaten item already has its next position when the hook `end_step` is called.

    Parameters
    ----------
    state : State
        Arrays that a step changes, and the compiled parts.
    world, item : int
        Indices of the world and of the item.
    step : int
        Step of the lifetime, from 0.

    Returns
    -------
    bool
        True from the eating to the end of the step.
    """
    return bool(state.touched[world, item] == step)
