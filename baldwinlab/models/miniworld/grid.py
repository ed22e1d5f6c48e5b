"""The grid cells of a region of items, and the images of the torus from which it can be reached.

Python and the compiled code of the browser use the same functions.
Lengths are float64, in units of length.
"""

from __future__ import annotations

from typing import Any, Final

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.simd import WIDTH, square_root

# Number of items up to which a region is a single cell.
MAX_UNSORTED_ITEMS: Final = 8 * WIDTH
# Average number of items in a cell.
ITEMS_PER_CELL: Final = 4
# Height of a cell, in widths. The items of a row of cells are contiguous in memory.
# A scan therefore tests few rows, and narrow cells contain few items out of reach.
CELL_HEIGHT_RATIO: Final = 3
# Maximum fraction of a region's area that an agent scans.
# Above it, a scan of all items is faster.
MAX_SCANNED_FRACTION: Final = 0.25
# Minimum number of agents that doubles the maximum fraction, because agents share the sorting.
MANY_AGENTS: Final = 12
# Half the diagonal of a square, in half sides.
SQUARE_DIAGONAL: Final = 1.4142135623730951
# Factor and summand of a distance that cover rounding, in units of length.
ROUNDING_FACTOR: Final = 1.001
ROUNDING_MARGIN: Final = 0.25


@compiled
def compute_cell_size(width: float, height: float, count: int) -> Any:
    """Return the width and height of a cell of a region with `count` items.

    A cell is at most as wide and as high as the region.
    """
    area = width * height
    items = max(1, count)
    cell_height = min(
        height,
        max(
            square_root(area * ITEMS_PER_CELL * CELL_HEIGHT_RATIO / items),
            height * ITEMS_PER_CELL / items,
        ),
    )
    return area * ITEMS_PER_CELL / (items * cell_height), cell_height


@compiled
def scanned_fraction(width: float, height: float, count: int, radius: float, agents: int) -> Any:
    """Return the fraction of a region's area in the cells that an agent scans.

    Return 1 if sorting the items does not save time.
    """
    cell_width, cell_height = compute_cell_size(width, height, count)
    scanned_area = min(width, 2 * radius + cell_width) * min(height, 2 * radius + cell_height)
    max_scanned_area = MAX_SCANNED_FRACTION * width * height * (2 if agents >= MANY_AGENTS else 1)
    # `>=` instead of `>`, because both areas are 0 if they are below the smallest float.
    is_too_large = scanned_area >= max_scanned_area
    if count <= MAX_UNSORTED_ITEMS or is_too_large:
        return 1.0
    return scanned_area / (width * height)


@compiled
def compute_grid_shape(
    width: float, height: float, count: int, radius: float, agents: int
) -> tuple[Any, Any]:
    """Return the numbers of columns and rows of the grid of a region.

    The grid is one cell if sorting the items does not save time.
    """
    if scanned_fraction(width, height, count, radius, agents) == 1.0:
        return 1, 1
    cell_width, cell_height = compute_cell_size(width, height, count)
    return max(1, round(width / cell_width)), max(1, round(height / cell_height))


@compiled
def compute_alert_radius(reach: float, square: bool, stride: float) -> float:
    """Return the distance beyond which no item can be touched after a move of `stride`."""
    farthest_touch = reach * (SQUARE_DIAGONAL if square else 1.0)
    return (farthest_touch + stride) * ROUNDING_FACTOR + ROUNDING_MARGIN


@compiled
def count_images(
    width: float, height: float, margin: float, world_width: float, world_height: float
) -> int:
    """Return the number of images of the torus within `margin` of a region: 1 or 9."""
    has_one_image = 2 * (width + margin) < world_width and 2 * (height + margin) < world_height
    return 1 if has_one_image else 9
