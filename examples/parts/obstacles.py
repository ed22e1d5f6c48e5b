"""A world feature: a wall that blocks movement, sight, births and items.

    baldwinlab run evo/A --part examples/parts/obstacles.py --set world.features='["obstacles"]' \
        world.obstacles.x='[300, 320]'
"""

import numpy as np

from baldwinlab.parts import Field, WorldFeature, choose

ZERO, ONE = np.float32(0), np.float32(1)


class Obstacles(WorldFeature, name="obstacles"):
    """A rectangular wall."""

    x: tuple[float, float] = Field(
        (280.0, 300.0), description="Left and right edge, in units of length."
    )
    y: tuple[float, float] = Field(
        (100.0, 220.0), description="Upper and lower edge, in units of length."
    )
    derived = {
        "left": lambda part, experiment: np.float32(part.x[0]),
        "right": lambda part, experiment: np.float32(part.x[1]),
        "upper": lambda part, experiment: np.float32(part.y[0]),
        "lower": lambda part, experiment: np.float32(part.y[1]),
    }

    def check(self, experiment):
        sides = {"x": (self.x, experiment.world.width), "y": (self.y, experiment.world.height)}
        for axis, ((low, high), size) in sides.items():
            if not 0 <= low < high <= size:
                raise ValueError(
                    f"world.obstacles.{axis} = [{low:g}, {high:g}] must be two increasing numbers "
                    f"from 0 to {size:g}"
                )

    def map_shapes(self):
        return (
            {"shape": "rectangle", "x": self.x, "y": self.y, "color": "#555555", "label": "wall"},
        )

    @staticmethod
    def blocks_placement(part, model, x, y):
        return part.left <= x and x <= part.right and part.upper <= y and y <= part.lower

    @staticmethod
    def blocks_movement(part, model, x, y):
        return (x >= part.left) & (x <= part.right) & (y >= part.upper) & (y <= part.lower)

    @staticmethod
    def blocks_sight(part, model, line):
        """Return whether the line of sight crosses the wall.

        The line is in the wall between `first` and `last`, as fractions of its length.
        """
        left = (part.left - line.x) / line.dx
        right = (part.right - line.x) / line.dx
        upper = (part.upper - line.y) / line.dy
        lower = (part.lower - line.y) / line.dy
        first_x = choose(left < right, left, right)
        last_x = choose(left < right, right, left)
        first_y = choose(upper < lower, upper, lower)
        last_y = choose(upper < lower, lower, upper)
        first = choose(first_x > first_y, first_x, first_y)
        last = choose(last_x < last_y, last_x, last_y)
        return (first <= last) & (last >= ZERO) & (first <= ONE)

    @staticmethod
    def oracle(part, x, y, dx, dy):
        """Return the result of each hook.

        A line crosses the wall unless it passes next to it, or all corners are on one side of it.
        """
        inside = part.left <= x <= part.right and part.upper <= y <= part.lower
        is_next_to_wall = max(x, x + dx) < part.left or min(x, x + dx) > part.right
        is_above_or_below = max(y, y + dy) < part.upper or min(y, y + dy) > part.lower
        sides = [
            dx * (b - y) - dy * (a - x)
            for a in (part.left, part.right)
            for b in (part.upper, part.lower)
        ]
        return {
            "blocks_placement": inside,
            "blocks_movement": inside,
            "blocks_sight": not (is_next_to_wall or is_above_or_below)
            and min(sides) <= 0 <= max(sides),
        }
