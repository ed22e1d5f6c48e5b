"""Real-valued senses of the first item on each of several rays.

`rays` has five rays, and senses items of one kind, which can be any kind. `food-rays` senses food,
and the experiment chooses the number of rays and the angle. Both senses are our interpretation of
the proximity sensors of S. Nolfi and D. Floreano, Evolutionary Robotics (2000).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import Array, per_agent
from baldwinlab.engine.simd import INFINITY, ONE, ZERO, square_root
from baldwinlab.models.miniworld.allocation import tabulate
from baldwinlab.models.miniworld.regions import kind_number
from baldwinlab.models.miniworld.senses.real_valued import ItemSense, record_items
from baldwinlab.models.miniworld.senses.sight import (
    is_within_sight,
    rotate_to_heading,
    select_visible,
)
from baldwinlab.models.miniworld.state import FOOD, HEADING_COUNT, MiniWorldModel, State
from baldwinlab.parts.senses import Sense, count_inputs
from baldwinlab.parts.world_features import LineOfSight

N_RAYS = 5
# Number of headings (of 9 degrees) between two rays.
HEADINGS_BETWEEN_RAYS = 3
# Angle of each ray from the heading, in degrees.
RAY_DEGREES = tuple(
    (ray - N_RAYS // 2) * HEADINGS_BETWEEN_RAYS * 360 // HEADING_COUNT for ray in range(N_RAYS)
)
# Half the width of the sector in which a drawing shows a ray, in degrees.
HALF_SECTOR = 2.0


@compiled
def measure_rays(part: Any, model: MiniWorldModel, state: State, world: int, agent: int) -> None:
    """Write the inputs of a sense with an input for each ray.

    An input is 1 - distance / `model.visual_radius` of the nearest item on the ray. The hook
    `record_item` of the sense lowers the squared distance `part.nearest` [ray, lane].
    """
    lane = world * model.agents + agent
    n_rays = count_inputs(part)
    squared_range = model.visual_radius * model.visual_radius
    for ray in range(n_rays):
        part.nearest[ray, lane] = squared_range
    record_items(part, model, state, world, agent)
    for ray in range(n_rays):
        distance = np.float32(square_root(part.nearest[ray, lane])) / model.visual_radius
        state.activations[part.first_input + ray, lane] = max(ONE - distance, ZERO)


class Rays(ItemSense, name="rays"):
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
        for degrees in RAY_DEGREES
    )
    sectors: ClassVar[tuple[tuple[float, float], ...]] = tuple(
        ((degrees - 2) % 360, (degrees + 2) % 360) for degrees in RAY_DEGREES
    )
    # [ray, lane]: squared distance of the nearest item on the ray.
    arrays: ClassVar[Mapping[str, Array]] = {"nearest": per_agent(N_RAYS)}

    @staticmethod
    def record_item(
        part: Any, model: MiniWorldModel, state: State, line: LineOfSight, lane: int
    ) -> None:
        dx = line.dx
        dy = line.dy
        squared_distance = dx * dx + dy * dy
        squared_radius = part.item_radius * part.item_radius
        is_visible = select_visible(state.features, model, line, squared_distance < INFINITY)
        first_direction = int(state.heading[0, lane]) - N_RAYS // 2 * HEADINGS_BETWEEN_RAYS
        for ray in range(N_RAYS if is_visible else 0):
            # `+ HEADING_COUNT` makes the sum positive.
            direction = (
                first_direction + HEADING_COUNT + ray * HEADINGS_BETWEEN_RAYS
            ) % HEADING_COUNT
            u, v = rotate_to_heading(model, dx, dy, direction)
            if (
                abs(v) <= part.item_radius
                and (u >= ZERO or squared_distance <= squared_radius)
                and squared_distance < part.nearest[ray, lane]
            ):
                part.nearest[ray, lane] = squared_distance

    @staticmethod
    def measure(part: Any, model: MiniWorldModel, state: State, world: int, agent: int) -> None:
        measure_rays(part, model, state, world, agent)


class FoodRays(Sense, name="food-rays"):
    """One real-valued input per ray: the first food item on the ray.

    The rays are numbered from left to right. Neighboring rays have equal angles between them, and
    the middle of the rays is the heading. An input is 1 - distance / `senses.visual_radius`, and 0
    if the ray meets no item. All rays meet an item that contains the agent.

    References
    ----------
    Nolfi and Floreano 2000.
    """

    rays: int = Field(5, ge=1, le=64, description="Number of rays, and of inputs.")
    angle: float = Field(
        108.0, ge=0, lt=360, description="Angle between the first and the last ray, in degrees."
    )
    item_radius: float = Field(
        5.0, gt=0, le=100_000, description="Radius of an item for a ray, in units of length."
    )
    only_items: ClassVar[bool] = True
    is_continuous: ClassVar[bool] = True
    # [ray, lane]: squared distance of the nearest item. The rows after the last ray are unused.
    arrays: ClassVar[Mapping[str, Array]] = {"nearest": per_agent("inputs")}
    derived: ClassVar[Mapping[str, Any]] = {
        "number": kind_number(FOOD),
        "cosine": lambda part, experiment: tabulate(math.cos, part.ray_degrees),
        "sine": lambda part, experiment: tabulate(math.sin, part.ray_degrees),
    }

    @property
    def ray_degrees(self) -> tuple[float, ...]:
        """Angle of each ray from the heading, in degrees clockwise."""
        gap = self.angle / max(self.rays - 1, 1)
        return tuple((ray - (self.rays - 1) / 2) * gap for ray in range(self.rays))

    @property
    def inputs(self) -> tuple[str, ...]:  # type: ignore[override]
        """Names of the inputs, such as "ray 1", from left to right."""
        return tuple(f"ray {ray + 1}" for ray in range(self.rays))

    @property
    def sectors(self) -> tuple[tuple[float, float] | None, ...]:  # type: ignore[override]
        """Sector of each ray in drawings, (first, last) in degrees clockwise from the heading."""
        return tuple(
            ((degrees - HALF_SECTOR) % 360, (degrees + HALF_SECTOR) % 360)
            for degrees in self.ray_degrees
        )

    @staticmethod
    def record_item(
        part: Any, model: MiniWorldModel, state: State, line: LineOfSight, lane: int
    ) -> None:
        dx = line.dx
        dy = line.dy
        squared_distance = dx * dx + dy * dy
        contains_agent = squared_distance <= part.item_radius * part.item_radius
        is_visible = is_within_sight(model, state, line)
        heading = int(state.heading[0, lane])
        # Coordinates of the item along and across the heading.
        ahead, right = rotate_to_heading(model, dx, dy, heading)
        for ray in range(part.n_inputs if is_visible else 0):
            # Coordinates of the item along and across the ray.
            u = ahead * part.cosine[ray] + right * part.sine[ray]
            v = right * part.cosine[ray] - ahead * part.sine[ray]
            if (
                abs(v) <= part.item_radius
                and (u >= ZERO or contains_agent)
                and squared_distance < part.nearest[ray, lane]
            ):
                part.nearest[ray, lane] = squared_distance

    @staticmethod
    def measure(part: Any, model: MiniWorldModel, state: State, world: int, agent: int) -> None:
        measure_rays(part, model, state, world, agent)
