"""World feature `walls`: rectangles that block movement and sight.

The feature is our interpretation, and not the world of a paper.

References
----------
D. Ackley and M. Littman, "Interactions between learning and evolution", Artificial Life II (1991).
The world of this paper has walls, plants and carnivores.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Annotated, Any, ClassVar

import numpy as np

from baldwinlab.engine.simd import ONE, ZERO
from baldwinlab.parts import Field, LineOfSight, WorldFeature, choose, compiled

Coordinate = Annotated[float, Field(ge=0, le=1_000_000)]
Derived = Mapping[str, Callable[[Any, Any], Any]]


def require_on_map(path: str, box: Iterable[float], world: Any) -> None:
    """Raise ValueError if a box is not on the map."""
    left, right, upper, lower = box
    if not (0 <= left < right <= world.width and 0 <= upper < lower <= world.height):
        listed = ", ".join(f"{edge:g}" for edge in (left, right, upper, lower))
        raise ValueError(
            f"{path} = [{listed}] must be left < right and upper < lower, on the map of "
            f"{world.width:g} x {world.height:g}"
        )


Box = tuple[Coordinate, Coordinate, Coordinate, Coordinate]


def _walls_and_images(part: Any, experiment: Any) -> Any:
    """Return [wall, (left, right, upper, lower)]: the walls, then images visible from the map."""
    width = experiment.world.width
    height = experiment.world.height
    sight = experiment.senses.visual_radius
    # Shifts to the eight neighboring images of the map.
    shifts = [(x * width, y * height) for x in (-1, 0, 1) for y in (-1, 0, 1) if x or y]
    images = [
        (left + x, right + x, upper + y, lower + y)
        for left, right, upper, lower in part.boxes
        for x, y in shifts
    ]
    visible_images = [
        (left, right, upper, lower)
        for left, right, upper, lower in images
        if right >= -sight and left <= width + sight and lower >= -sight and upper <= height + sight
    ]
    return np.array([*part.boxes, *visible_images], np.float32)


def _map_frame(part: Any, experiment: Any) -> Any:
    """Return the settings that determine the images of walls. No hook reads the array.

    The array makes these settings constants, which a page without a server cannot change.
    """
    return np.array(
        [experiment.world.width, experiment.world.height, experiment.senses.visual_radius],
        np.float32,
    )


@compiled
def _is_inside(edges: Any, count: int, x: Any, y: Any) -> Any:
    """Return whether a position is in any of the first `count` walls."""
    # False, as a mask with the lanes of x.
    blocked = x * ZERO > ONE
    for wall in range(count):
        blocked = blocked | (
            (x >= edges[wall, 0])
            & (x <= edges[wall, 1])
            & (y >= edges[wall, 2])
            & (y <= edges[wall, 3])
        )
    return blocked


@compiled
def _blocks_line(edges: Any, wall: int, x: Any, y: Any, dx: Any, dy: Any) -> Any:
    """Return whether the line from (x, y) to (x + dx, y + dy) crosses a wall.

    The wall is the intersection of a vertical and a horizontal strip. The line crosses the wall if
    a point of the line is in both strips. The times of a point are fractions of the line.
    """
    enters_x = (edges[wall, 0] - x) / dx
    leaves_x = (edges[wall, 1] - x) / dx
    enters_y = (edges[wall, 2] - y) / dy
    leaves_y = (edges[wall, 3] - y) / dy
    first_x = choose(enters_x < leaves_x, enters_x, leaves_x)
    last_x = choose(enters_x < leaves_x, leaves_x, enters_x)
    first_y = choose(enters_y < leaves_y, enters_y, leaves_y)
    last_y = choose(enters_y < leaves_y, leaves_y, enters_y)
    entry_time = choose(first_x > first_y, first_x, first_y)
    exit_time = choose(last_x < last_y, last_x, last_y)
    return (entry_time <= exit_time) & (exit_time >= ZERO) & (entry_time <= ONE)


class Walls(WorldFeature, name="walls"):
    """Rectangles that block movement and sight.

    No agent is born and no item appears inside a wall.
    """

    boxes: tuple[Box, ...] = Field(
        ((280.0, 300.0, 100.0, 160.0), (280.0, 300.0, 180.0, 240.0)),
        min_length=1,
        max_length=64,
        description=("One row per wall: left, right, upper and lower edge, in units of length."),
    )
    derived: ClassVar[Derived] = {
        "edges": _walls_and_images,
        "count": lambda part, experiment: len(part.boxes),
        "frame": _map_frame,
    }

    def check(self, experiment: Any) -> None:
        """Check that walls are on the map, and do not cover a region.

        A wall must be as thick as a step, because an agent could step over a thinner wall.
        """
        world = experiment.world
        stride = experiment.part("motor.body").stride
        start = experiment.world.start
        disc = (
            start.x - start.radius,
            start.x + start.radius,
            start.y - start.radius,
            start.y + start.radius,
        )
        boxes = {"world.start": disc} | {
            f"world.food[{k}]": (*food.x, *food.y) for k, food in enumerate(world.food)
        }
        for wall_index, (left, right, upper, lower) in enumerate(self.boxes):
            path = f"world.walls.boxes[{wall_index}]"
            require_on_map(path, (left, right, upper, lower), world)
            if min(right - left, lower - upper) < stride:
                raise ValueError(
                    f"{path} must be at least {stride:g} thick, or it could be stepped over"
                )
            for name, box in boxes.items():
                box_left, box_right, box_upper, box_lower = box
                covers_x = left <= box_left and box_right <= right
                covers_y = upper <= box_upper and box_lower <= lower
                if covers_x and covers_y:
                    raise ValueError(f"{path} covers {name} completely")

    def map_shapes(self) -> tuple[dict[str, Any], ...]:
        return tuple(
            {
                "shape": "rectangle",
                "x": (left, right),
                "y": (upper, lower),
                "color": "gray",
                "label": "wall",
            }
            for left, right, upper, lower in self.boxes
        )

    @staticmethod
    def blocks_placement(part: Any, model: Any, x: Any, y: Any) -> Any:
        return _is_inside(part.edges, part.count, x, y)

    @staticmethod
    def blocks_movement(part: Any, model: Any, x: Any, y: Any) -> Any:
        return _is_inside(part.edges, part.count, x, y)

    @staticmethod
    def blocks_sight(part: Any, model: Any, line: LineOfSight) -> Any:
        # False, as a mask with the lanes of dx.
        blocked = line.dx * ZERO > ONE
        for wall in range(part.edges.shape[0]):
            blocked = blocked | _blocks_line(part.edges, wall, line.x, line.y, line.dx, line.dy)
        return blocked
