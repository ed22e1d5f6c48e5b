"""Rays of a number and an angle that the experiment chooses, and the first food on each ray.

The sense is our interpretation of the proximity sensors of S. Nolfi and D. Floreano, Evolutionary
Robotics (2000).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

from pydantic import Field

from baldwinlab.engine.phases import Array, per_agent
from baldwinlab.engine.simd import ZERO
from baldwinlab.models.miniworld.allocation import tabulate
from baldwinlab.models.miniworld.regions import kind_number
from baldwinlab.models.miniworld.senses.real_valued import measure_rays
from baldwinlab.models.miniworld.senses.sight import is_within_sight, rotate_to_heading
from baldwinlab.models.miniworld.state import FOOD, MiniWorldModel, State
from baldwinlab.parts.senses import Sense
from baldwinlab.parts.world_features import LineOfSight

# Half the width of the sector in which a drawing shows a ray, in degrees.
HALF_SECTOR = 2.0


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
    # Squared distance of the nearest item on each ray. The rays are some of all inputs.
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
        """Names of the inputs, from left to right."""
        return tuple(f"ray {ray + 1}" for ray in range(self.rays))

    @property
    def sectors(self) -> tuple[tuple[float, float] | None, ...]:  # type: ignore[override]
        """Sector of each ray, for drawings."""
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
