"""Real-valued senses: the nearest food, food along rays, its smell at two nostrils, and one's own energy.

What they tell of food, they tell of another kind of items where their field `of` says so.

Each input is a float32 in [0, 1]. What is seen, or smelled, lies within `senses.visual_radius`; walls hide it from sight, but
not its smell. A network's answers to such inputs are not looked up but calculated in every step.

Sources: the nearest food by angle and distance, S. Nolfi, J. L. Elman and D. Parisi, "Learning and evolution in neural networks",
Adaptive Behavior 3 (1994); rays and a sense of one's energy, S. Nolfi and D. Floreano, Evolutionary Robotics (2000); a smell
at two places of the body, V. Braitenberg, Vehicles (1984). Their shapes here are readings of ours.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from copy import copy
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from baldwinlab.engine.arithmetic import share_of_turn
from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import Array, hook, per_agent
from baldwinlab.engine.simd import (
    Lane,
    Value,
    any_of,
    get,
    lanes_in_block,
    simd_block,
    square_root,
)
from baldwinlab.experiment.registry import key_of
from baldwinlab.models.miniworld.allocation import item_kinds, item_regions, kind_number
from baldwinlab.models.miniworld.items import (
    find_cells_within,
    find_slots_in_row,
    position_in_image,
)
from baldwinlab.models.miniworld.senses.sight import select_visible
from baldwinlab.models.miniworld.state import FOOD, HEADING_COUNT, Model, State
from baldwinlab.parts.agent_parts import Sense

ZERO, HALF, ONE = np.float32(0), np.float32(0.5), np.float32(1)
FAR = np.float32(np.inf)
RAYS, HEADINGS_PER_RAY = 5, 3  # headings from one ray to the next, of 9 degrees each
DEGREES = tuple((ray - RAYS // 2) * HEADINGS_PER_RAY * 360 // HEADING_COUNT for ray in range(RAYS))


@hook
def record_item(
    part: Any,
    model: Model,
    state: State,
    lane: int,
    x: np.float32,
    y: np.float32,
    dx: np.float32,
    dy: np.float32,
) -> None:
    """Per agent, at (x, y): take account of an item that is (dx, dy) away, within `model.visual_radius`."""


@compiled
def _squared_distance(state: State, world: int, slot: Lane, x: np.float32, y: np.float32) -> Value:
    dx, dy = get(state.slot_x, world, slot) - x, get(state.slot_y, world, slot) - y
    return dx * dx + dy * dy


@compiled
def _record_region_items(
    part: Any,
    model: Model,
    state: State,
    world: int,
    region: int,
    lane: int,
    x: np.float32,
    y: np.float32,
) -> None:
    """`notice` each item of a region that is near enough, one after another in the order of their slots."""
    farthest = model.visual_radius * model.visual_radius
    columns = find_cells_within(model, region, 0, x, model.visual_radius)
    first_row, last_row = find_cells_within(model, region, 1, y, model.visual_radius)
    for row in range(first_row, last_row):
        begin, end = find_slots_in_row(model, state, world, region, row, columns)
        for first in range(begin, end, lanes_in_block()):
            if any_of(_squared_distance(state, world, simd_block(first), x, y) <= farthest):
                for slot in range(first, min(first + lanes_in_block(), end)):
                    if _squared_distance(state, world, slot, x, y) <= farthest:
                        dx, dy = state.slot_x[world, slot] - x, state.slot_y[world, slot] - y
                        record_item(part, model, state, lane, x, y, dx, dy)


@compiled
def record_items(part: Any, model: Model, state: State, world: int, agent: int) -> None:
    """Per agent: `notice` all items of the part's kind that are near enough."""
    lane = world * model.agents + agent
    for region in range(model.regions.shape[0] if state.near[0, lane] > HALF else 0):
        if model.region_kind[region] == part.number:
            for number in range(model.images[region]):
                x, y = position_in_image(
                    model, region, number, state.positions[0, lane], state.positions[1, lane]
                )
                _record_region_items(part, model, state, world, region, lane, x, y)


class _ItemSense(Sense):
    """What senses of items share: the kind that they tell of."""

    target_kind: str = Field(FOOD, description="Kind of the sensed items.")
    only_items: ClassVar[bool] = True
    is_continuous: ClassVar[bool] = True
    derived: ClassVar[Mapping[str, Any]] = {
        "number": lambda part, experiment: kind_number(part.target_kind)(part, experiment)
    }

    def check(self, experiment: Any) -> None:
        if self.target_kind not in (kinds := item_kinds(experiment)):
            raise ValueError(
                f"senses.{key_of(self.name)}.target_kind = {self.target_kind!r} must be one of the "
                f"kinds of items: {', '.join(kinds)}"
            )


class Nearest(_ItemSense, name="nearest"):
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
    arrays: ClassVar[Mapping[str, Array]] = {
        "nearest": per_agent(3)
    }  # the way to it, squared, and in x and y

    @staticmethod
    def record_item(
        part: Any,
        model: Model,
        state: State,
        lane: int,
        x: np.float32,
        y: np.float32,
        dx: np.float32,
        dy: np.float32,
    ) -> None:
        squared = dx * dx + dy * dy
        if select_visible(state.features, model, x, y, dx, dy, squared < part.nearest[0, lane]):
            part.nearest[0, lane] = squared
            part.nearest[1, lane] = dx
            part.nearest[2, lane] = dy

    @staticmethod
    def measure(part: Any, model: Model, state: State, world: int, agent: int, first: int) -> None:
        lane = world * model.agents + agent
        part.nearest[0, lane] = FAR
        record_items(part, model, state, world, agent)
        heading, angle, distance = int(state.heading[0, lane]), ZERO, ONE
        if part.nearest[0, lane] < FAR:
            dx, dy = part.nearest[1, lane], part.nearest[2, lane]
            u = dx * model.cosine[heading] + dy * model.sine[heading]
            v = dy * model.cosine[heading] - dx * model.sine[heading]
            angle = share_of_turn(u, v)
            distance = min(
                ONE, np.float32(square_root(part.nearest[0, lane])) / model.visual_radius
            )
        state.activations[first, lane] = angle
        state.activations[first + 1, lane] = distance

    @staticmethod
    def oracle(part: Any, agent: Any, items: Any, naive: Any) -> Any:
        food = [
            item
            for item in items
            if item.kind == naive.kinds[part.number]
            and naive.distance(agent, item) <= naive.visual_radius
        ]
        if not food:
            return [0, 1]
        nearest = min(food, key=lambda item: naive.distance(agent, item))
        return [
            naive.bearing(agent, nearest) / 360,
            naive.distance(agent, nearest) / naive.visual_radius,
        ]


class Smell(_ItemSense, name="smell"):
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
    arrays: ClassVar[Mapping[str, Array]] = {"strength": per_agent(2)}
    derived: ClassVar[Mapping[str, Any]] = {
        **_ItemSense.derived,
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
        part: Any,
        model: Model,
        state: State,
        lane: int,
        x: np.float32,
        y: np.float32,
        dx: np.float32,
        dy: np.float32,
    ) -> None:
        heading = int(state.heading[0, lane])
        u = dx * model.cosine[heading] + dy * model.sine[heading]
        v = dy * model.cosine[heading] - dx * model.sine[heading]
        for side in range(2):
            aside = v - part.nostril_distance if side == 1 else v + part.nostril_distance
            left = ONE - (u * u + aside * aside) / (part.reach * part.reach)
            if left > ZERO:
                part.strength[side, lane] += left * left

    @staticmethod
    def measure(part: Any, model: Model, state: State, world: int, agent: int, first: int) -> None:
        lane = world * model.agents + agent
        part.strength[0, lane] = ZERO
        part.strength[1, lane] = ZERO
        record_items(part, model, state, world, agent)
        for side in range(2):
            strength = part.strength[side, lane]
            state.activations[first + side, lane] = strength / (ONE + strength)

    @staticmethod
    def oracle(part: Any, agent: Any, items: Any, naive: Any) -> Any:
        smells = []
        for side in (-90, 90):
            nostril = copy(agent)
            nostril.heading = agent.heading + side
            naive.advance(nostril, float(part.nostril_distance))
            shares = [
                naive.distance(nostril, item) / float(part.reach)
                for item in items
                if item.kind == naive.kinds[part.number]
            ]
            strength = sum((1 - share**2) ** 2 for share in shares if share < 1)
            smells.append(strength / (1 + strength))
        return smells


class Energy(Sense, name="energy"):
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
    derived: ClassVar[Mapping[str, Any]] = {
        "energies": lambda part, experiment: np.array(
            [region.energy for region in item_regions(experiment)], np.float32
        )
    }

    @staticmethod
    def measure(part: Any, model: Model, state: State, world: int, agent: int, first: int) -> None:
        lane, gained = world * model.agents + agent, ZERO
        for region in range(part.energies.size):
            gained += part.energies[region] * np.float32(
                state.eaten_in_life[region, lane] - state.eaten_before[region, lane]
            )
        gained = max(gained, ZERO)
        state.activations[first, lane] = gained / (gained + part.half_saturation)

    @staticmethod
    def oracle(part: Any, agent: Any, items: Any, naive: Any) -> Any:
        gained = max(0.0, agent.gained_in_life)
        return [gained / (gained + float(part.half_saturation))]


class Rays(_ItemSense, name="rays"):
    """Five real-valued inputs: the first item on each of five rays, 27 degrees apart.

    An input is 1 - distance / `senses.visual_radius`, and 0 if the ray meets no item.
    All rays meet an item that contains the agent.

    References
    ----------
    Nolfi and Floreano 2000.
    """

    item_radius: float = Field(
        5.0, gt=0, le=100_000, description="Radius of an item for a ray, in units of length."
    )
    inputs: ClassVar[tuple[str, ...]] = tuple(
        f"ray {abs(degrees)} {'left' if degrees < 0 else 'right'}" if degrees else "ray ahead"
        for degrees in DEGREES
    )
    sectors: ClassVar[tuple[tuple[float, float], ...]] = tuple(
        ((each - 2) % 360, (each + 2) % 360) for each in DEGREES
    )
    arrays: ClassVar[Mapping[str, Array]] = {"nearest": per_agent(RAYS)}  # squared distances

    @staticmethod
    def record_item(
        part: Any,
        model: Model,
        state: State,
        lane: int,
        x: np.float32,
        y: np.float32,
        dx: np.float32,
        dy: np.float32,
    ) -> None:
        squared, wide = dx * dx + dy * dy, part.item_radius * part.item_radius
        for ray in range(
            RAYS if select_visible(state.features, model, x, y, dx, dy, squared < FAR) else 0
        ):
            towards = (
                int(state.heading[0, lane]) + HEADING_COUNT + (ray - RAYS // 2) * HEADINGS_PER_RAY
            ) % HEADING_COUNT
            u = dx * model.cosine[towards] + dy * model.sine[towards]
            v = dy * model.cosine[towards] - dx * model.sine[towards]
            if (
                abs(v) <= part.item_radius
                and (u >= ZERO or squared <= wide)
                and squared < part.nearest[ray, lane]
            ):
                part.nearest[ray, lane] = squared

    @staticmethod
    def measure(part: Any, model: Model, state: State, world: int, agent: int, first: int) -> None:
        lane, farthest = world * model.agents + agent, model.visual_radius * model.visual_radius
        for ray in range(RAYS):
            part.nearest[ray, lane] = farthest
        record_items(part, model, state, world, agent)
        for ray in range(RAYS):
            distance = np.float32(square_root(part.nearest[ray, lane])) / model.visual_radius
            state.activations[first + ray, lane] = max(ONE - distance, ZERO)

    @staticmethod
    def oracle(part: Any, agent: Any, items: Any, naive: Any) -> Any:
        def closeness(ray: float) -> float:
            met = []
            for item in (item for item in items if item.kind == naive.kinds[part.number]):
                way, aside = (
                    naive.distance(agent, item),
                    math.radians(naive.bearing(agent, item) - ray),
                )
                if abs(way * math.sin(aside)) <= part.item_radius and (
                    math.cos(aside) >= 0 or way <= part.item_radius
                ):
                    met.append(way)
            return max(0.0, 1 - float(min(met, default=math.inf)) / float(naive.visual_radius))

        return [closeness(each) for each in DEGREES]
