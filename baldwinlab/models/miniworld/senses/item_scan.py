"""Scan of the items within the visual radius of an agent, for real-valued senses."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import hook
from baldwinlab.engine.simd import HALF, Lane, Value, any_of, get, lanes_in_block, simd_block
from baldwinlab.experiment.registry import table_name
from baldwinlab.models.miniworld.items import (
    find_cells_within,
    find_slots_in_row,
    position_in_image,
)
from baldwinlab.models.miniworld.regions import item_kinds, kind_number
from baldwinlab.models.miniworld.state import FOOD, MiniWorldModel, State
from baldwinlab.parts.senses import Sense
from baldwinlab.parts.world_features import LineOfSight


@hook
def record_item(
    part: Any, model: MiniWorldModel, state: State, line: LineOfSight, lane: int
) -> None:
    """Use an item in range.

    Per agent, for each item within `model.visual_radius`, when the sense calls `record_items`. A
    feature can hide the item, see `is_within_sight`.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings, derived values and arrays of the part.
    model : MiniWorldModel
        Constants of the lifetime. Read only.
    state : State
        Arrays of the step, and the other parts.
    line : LineOfSight
        The line from the agent to the item.
    lane : int
        Column of the agent that senses.
    """


@compiled
def _squared_distance(state: State, world: int, slot: Lane, x: np.float32, y: np.float32) -> Value:
    """Return the squared distance of the item in a slot from (x, y)."""
    dx = get(state.slot_x, world, slot) - x
    dy = get(state.slot_y, world, slot) - y
    return dx * dx + dy * dy


@compiled
def _record_region_items(
    part: Any,
    model: MiniWorldModel,
    state: State,
    world: int,
    region: int,
    lane: int,
    x: np.float32,
    y: np.float32,
) -> None:
    """Call `record_item` for each item of a region in range, in the order of slots."""
    squared_range = model.visual_radius * model.visual_radius
    columns = find_cells_within(model, region, 0, x, model.visual_radius)
    first_row, end_row = find_cells_within(model, region, 1, y, model.visual_radius)
    for row in range(first_row, end_row):
        first_slot, end_slot = find_slots_in_row(model, state, world, region, row, columns)
        for first in range(first_slot, end_slot, lanes_in_block()):
            if any_of(_squared_distance(state, world, simd_block(first), x, y) <= squared_range):
                for slot in range(first, min(first + lanes_in_block(), end_slot)):
                    if _squared_distance(state, world, slot, x, y) <= squared_range:
                        dx = state.slot_x[world, slot] - x
                        dy = state.slot_y[world, slot] - y
                        record_item(part, model, state, LineOfSight(x, y, dx, dy), lane)


@compiled
def record_items(part: Any, model: MiniWorldModel, state: State, world: int, agent: int) -> None:
    """Call `record_item` for each item of a kind within `model.visual_radius`.

    Parameters
    ----------
    part : NamedTuple
        The first argument of a hook. `part.number` is the number of the kind, see `kind_number`.
    model : MiniWorldModel
        Constants of the lifetime. Read only.
    state : State
        Arrays of the step, and the other parts.
    world, agent : int
        Indices of the world and of the agent in it.
    """
    lane = world * model.agents + agent
    is_near_items = state.near[0, lane] > HALF
    for region in range(model.regions.shape[0] if is_near_items else 0):
        if model.region_kind[region] == part.number:
            for number in range(model.images[region]):
                x, y = position_in_image(
                    model, region, number, state.positions[0, lane], state.positions[1, lane]
                )
                _record_region_items(part, model, state, world, region, lane, x, y)


class ItemSense(Sense):
    """Base of the senses that read the items of a kind, with `record_items` and `record_item`.

    The setting `target_kind` chooses the kind.
    """

    target_kind: str = Field(FOOD, description="Kind of the sensed items.")
    only_items: ClassVar[bool] = True
    is_continuous: ClassVar[bool] = True
    derived: ClassVar[Mapping[str, Any]] = {
        "number": lambda part, experiment: kind_number(part.target_kind)(part, experiment)
    }

    record_item: ClassVar[Any] = staticmethod(record_item.default)

    def check(self, experiment: Any) -> None:
        kinds = item_kinds(experiment)
        if self.target_kind not in kinds:
            raise ValueError(
                f"senses.{table_name(self.name)}.target_kind = {self.target_kind!r} "
                f"must be one of the kinds of items: {', '.join(kinds)}"
            )
