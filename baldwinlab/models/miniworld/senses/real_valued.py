"""Real-valued senses: the nearest item, the smell of items, and the agent's energy.

The field `target_kind` of a sense names the kind of the sensed items: food by default.

Each input is a float32 in [0, 1]. Sensed items are within `senses.visual_radius`.
Walls block sight but not smell.
The network is evaluated in every step, because a lookup table needs binary inputs.

The formulas are our interpretation of the sources:

- Angle and distance of the nearest food: S. Nolfi, J. L. Elman and D. Parisi, "Learning and
  evolution in neural networks", Adaptive Behavior 3 (1994).
- Energy: S. Nolfi and D. Floreano, Evolutionary Robotics (2000).
- Smell at two points of the body: V. Braitenberg, Vehicles (1984).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from baldwinlab.engine.arithmetic import share_of_turn
from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import Array, hook, per_agent
from baldwinlab.engine.simd import (
    HALF,
    INFINITY,
    ONE,
    ZERO,
    Lane,
    Value,
    any_of,
    get,
    lanes_in_block,
    simd_block,
    square_root,
)
from baldwinlab.experiment.registry import table_name
from baldwinlab.models.miniworld.items import (
    find_cells_within,
    find_slots_in_row,
    position_in_image,
)
from baldwinlab.models.miniworld.regions import (
    ENERGY_VALUES,
    energy_in_life,
    item_kinds,
    kind_number,
)
from baldwinlab.models.miniworld.senses.sight import rotate_to_heading, select_visible
from baldwinlab.models.miniworld.state import FOOD, MiniWorldModel, State
from baldwinlab.parts.senses import Sense
from baldwinlab.parts.world_features import LineOfSight


@hook
def record_item(
    part: Any, model: MiniWorldModel, state: State, line: LineOfSight, lane: int
) -> None:
    """Update the arrays of the sense with an item in range.

    Per agent, for each item within `model.visual_radius`, when the sense calls `record_items`. A
    feature can hide the item, see `is_within_sight`.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings, derived values and arrays of the part.
    model : MiniWorldModel
        Constants of the lifetime. Read only.
    state : State
        Arrays that a step changes, and the compiled parts.
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
        Arrays that a step changes, and the compiled parts.
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

    The setting `target_kind` is the name of the kind.
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


class Nearest(ItemSense, name="nearest"):
    """Two real-valued inputs: angle and distance of the nearest item of a kind.

    The angle is clockwise from the heading, as a fraction of 360 degrees.
    The distance is a fraction of `senses.visual_radius`.
    Without an item in the visual range, the angle is 0 and the distance 1.

    References
    ----------
    Nolfi, Elman and Parisi 1994.
    """

    inputs: ClassVar[tuple[str, ...]] = ("angle", "distance")
    sectors: ClassVar[tuple[None, ...]] = (None, None)
    # [row, lane]: squared distance of the nearest item, then dx and dy from the agent to the item.
    arrays: ClassVar[Mapping[str, Array]] = {"nearest": per_agent(3)}

    @staticmethod
    def record_item(
        part: Any, model: MiniWorldModel, state: State, line: LineOfSight, lane: int
    ) -> None:
        dx = line.dx
        dy = line.dy
        squared_distance = dx * dx + dy * dy
        is_nearer = squared_distance < part.nearest[0, lane]
        if select_visible(state.features, model, line, is_nearer):
            part.nearest[0, lane] = squared_distance
            part.nearest[1, lane] = dx
            part.nearest[2, lane] = dy

    @staticmethod
    def measure(part: Any, model: MiniWorldModel, state: State, world: int, agent: int) -> None:
        lane = world * model.agents + agent
        part.nearest[0, lane] = INFINITY
        record_items(part, model, state, world, agent)
        heading = int(state.heading[0, lane])
        angle = ZERO
        distance = ONE
        if part.nearest[0, lane] < INFINITY:
            dx = part.nearest[1, lane]
            dy = part.nearest[2, lane]
            u, v = rotate_to_heading(model, dx, dy, heading)
            angle = share_of_turn(u, v)
            distance = min(
                ONE, np.float32(square_root(part.nearest[0, lane])) / model.visual_radius
            )
        state.activations[part.first_input, lane] = angle
        state.activations[part.first_input + 1, lane] = distance


class Smell(ItemSense, name="smell"):
    """Two real-valued inputs: the smell of all items of a kind at a left and a right nostril.

    An input is s / (1 + s).
    An item at distance d adds (1 - (d / r)^2)^2 to s, where r is `senses.visual_radius` minus
    `nostril_distance`.
    Walls do not block smell.

    References
    ----------
    Braitenberg 1984.
    """

    nostril_distance: float = Field(
        5.0,
        gt=0,
        le=100_000,
        description="Distance of each nostril from the center, in units of length.",
    )
    inputs: ClassVar[tuple[str, ...]] = ("smell left", "smell right")
    sectors: ClassVar[tuple[tuple[float, float], ...]] = ((180, 360), (0, 180))
    # [nostril, lane]: s of the formula, at the left and the right nostril.
    arrays: ClassVar[Mapping[str, Array]] = {"strength": per_agent(2)}
    derived: ClassVar[Mapping[str, Any]] = {
        **ItemSense.derived,
        "reach": lambda part, experiment: np.float32(
            experiment.senses.visual_radius - part.nostril_distance
        ),
    }

    def check(self, experiment: Any) -> None:
        super().check(experiment)
        if self.nostril_distance >= experiment.senses.visual_radius:
            raise ValueError(
                f"senses.smell.nostril_distance = {self.nostril_distance:g} must be less than "
                f"{experiment.senses.visual_radius:g}, the visual radius"
            )

    @staticmethod
    def record_item(
        part: Any, model: MiniWorldModel, state: State, line: LineOfSight, lane: int
    ) -> None:
        heading = int(state.heading[0, lane])
        u, v = rotate_to_heading(model, line.dx, line.dy, heading)
        for side in range(2):
            across = v + part.nostril_distance if side == 0 else v - part.nostril_distance
            closeness = ONE - (u * u + across * across) / (part.reach * part.reach)
            if closeness > ZERO:
                part.strength[side, lane] += closeness * closeness

    @staticmethod
    def measure(part: Any, model: MiniWorldModel, state: State, world: int, agent: int) -> None:
        lane = world * model.agents + agent
        part.strength[0, lane] = ZERO
        part.strength[1, lane] = ZERO
        record_items(part, model, state, world, agent)
        for side in range(2):
            strength = part.strength[side, lane]
            state.activations[part.first_input + side, lane] = strength / (ONE + strength)


class EnergySense(Sense, name="energy"):
    """One real-valued input: the energy g gained in life, as g / (g + `half_saturation`).

    The input is 0 if g is below 0.

    References
    ----------
    Nolfi and Floreano 2000.
    """

    half_saturation: float = Field(
        10.0, gt=0, le=1_000_000, description="Energy at which the input is 1/2."
    )
    inputs: ClassVar[tuple[str, ...]] = ("own energy",)
    sectors: ClassVar[tuple[None, ...]] = (None,)
    is_continuous: ClassVar[bool] = True
    derived: ClassVar[Mapping[str, Any]] = ENERGY_VALUES

    @staticmethod
    def measure(part: Any, model: MiniWorldModel, state: State, world: int, agent: int) -> None:
        lane = world * model.agents + agent
        gained_energy = max(energy_in_life(part, state, lane), ZERO)
        state.activations[part.first_input, lane] = gained_energy / (
            gained_energy + part.half_saturation
        )
