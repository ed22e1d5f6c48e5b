"""Walls: they stop motion and sight, nobody is born and nothing grows inside them.

baldwinlab run evo/A --part examples/parts/obstacles.py --set world.features='["obstacles"]' world.obstacles.x='[300, 320]'
"""

import numpy as np

from baldwinlab.parts import Field, WorldFeature, choose

ZERO, ONE = np.float32(0), np.float32(1)


class Obstacles(WorldFeature, name="obstacles"):
    """A wall, from edge to edge in x and in y."""

    x: tuple[float, float] = Field(
        (280.0, 300.0), description="left and right edge, units of length"
    )
    y: tuple[float, float] = Field(
        (100.0, 220.0), description="upper and lower edge, units of length"
    )
    derived = {
        "left": lambda part, experiment: np.float32(part.x[0]),
        "right": lambda part, experiment: np.float32(part.x[1]),
        "upper": lambda part, experiment: np.float32(part.y[0]),
        "lower": lambda part, experiment: np.float32(part.y[1]),
    }

    def check(self, experiment):
        for axis, (low, high), end in (
            ("x", self.x, experiment.world.width),
            ("y", self.y, experiment.world.height),
        ):
            if not 0 <= low < high <= end:
                raise ValueError(
                    f"world.obstacles.{axis} = [{low:g}, {high:g}] must rise, and lie from 0 to {end:g}"
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
    def blocks_sight(part, model, x, y, dx, dy):
        """Whether the line of sight meets the wall: the shares of the way at which it enters and leaves its two strips."""
        enters_x, leaves_x = (part.left - x) / dx, (part.right - x) / dx
        enters_y, leaves_y = (part.upper - y) / dy, (part.lower - y) / dy
        first_x, last_x = (
            choose(enters_x < leaves_x, enters_x, leaves_x),
            choose(enters_x < leaves_x, leaves_x, enters_x),
        )
        first_y, last_y = (
            choose(enters_y < leaves_y, enters_y, leaves_y),
            choose(enters_y < leaves_y, leaves_y, enters_y),
        )
        first = choose(first_x > first_y, first_x, first_y)
        last = choose(last_x < last_y, last_x, last_y)
        return (first <= last) & (last >= ZERO) & (first <= ONE)

    @staticmethod
    def oracle(part, x, y, dx, dy):
        """A way meets the wall unless it lies beside it, or has all of its corners at the same hand."""
        inside = part.left <= x <= part.right and part.upper <= y <= part.lower
        beside = max(x, x + dx) < part.left or min(x, x + dx) > part.right
        above = max(y, y + dy) < part.upper or min(y, y + dy) > part.lower
        hands = [
            dx * (b - y) - dy * (a - x)
            for a in (part.left, part.right)
            for b in (part.upper, part.lower)
        ]
        return {
            "blocks_placement": inside,
            "blocks_movement": inside,
            "blocks_sight": not (beside or above) and min(hands) <= 0 <= max(hands),
        }
