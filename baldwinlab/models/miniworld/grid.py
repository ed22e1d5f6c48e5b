"""How the items of a region are sorted into cells, and from how far it is reached.

Written once for whoever allocates: Python, and compiled code in a browser. Lengths are float64, in units of length.
"""

from __future__ import annotations

from typing import Any, Final

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.simd import WIDTH, square_root

FEW_ITEMS: Final = 8 * WIDTH
ITEMS_PER_CELL: Final = 4  # on average
CELL_HEIGHT_RATIO: Final = 3  # times its width: items of a row lie side by side, so few rows, and narrow cells, have few in vain
MAX_SCANNED_FRACTION: Final = (
    0.25  # of a region's area: where an agent looks at more of it, to look at all is faster
)
MANY_AGENTS: Final = 12  # agents, for whom twice as much is worth sorting, as they share in it


@compiled
def compute_cell_size(width: float, height: float, count: int) -> Any:
    """Width and height of the cells that a region's items are sorted into: in a strip, however thin, as long as hold so many."""
    area, items = width * height, max(1, count)
    high = min(
        height,
        max(
            square_root(area * ITEMS_PER_CELL * CELL_HEIGHT_RATIO / items),
            height * ITEMS_PER_CELL / items,
        ),
    )
    return area * ITEMS_PER_CELL / (items * high), high


@compiled
def scanned_fraction(width: float, height: float, count: int, radius: float, agents: int) -> Any:
    """Of a region's area, in whose cells an agent looks at the items; 1 where they are not worth sorting."""
    cell_width, cell_height = compute_cell_size(width, height, count)
    looked_at = min(width, 2 * radius + cell_width) * min(height, 2 * radius + cell_height)
    worth = MAX_SCANNED_FRACTION * width * height * (2 if agents >= MANY_AGENTS else 1)
    if count <= FEW_ITEMS or looked_at >= worth:  # equal where both are less than any float
        return 1.0
    return looked_at / (width * height)


@compiled
def compute_grid_shape(
    width: float, height: float, count: int, radius: float, agents: int
) -> tuple[Any, Any]:
    """Of the cells that a region's items are sorted into.

    One cell for a few items, and where an agent would have to look at most cells anyway.
    """
    if scanned_fraction(width, height, count, radius, agents) == 1.0:
        return 1, 1
    cell_width, cell_height = compute_cell_size(width, height, count)
    return max(1, round(width / cell_width)), max(1, round(height / cell_height))


@compiled
def compute_alert_radius(reach: float, square: bool, stride: float) -> float:
    """Nothing farther than this when sensed can be touched after a move of `stride`."""
    farthest_touch = reach * (1.4142135623730951 if square else 1.0)
    return (farthest_touch + stride) * 1.001 + 0.25  # with room for rounding


@compiled
def count_images(
    width: float, height: float, margin: float, world_width: float, world_height: float
) -> int:
    """From how many images of the torus a region may be reached that one can be `margin` away from: 1, or 9."""
    return 1 if 2 * (width + margin) < world_width and 2 * (height + margin) < world_height else 9
