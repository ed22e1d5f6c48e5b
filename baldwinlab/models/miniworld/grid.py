"""The grid cells of a region of items, and the images of the torus that are near the region.

Lengths are float64. Python and the WebAssembly module of the browser use the same functions.
"""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.simd import WIDTH, square_root
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.regions import item_kinds, item_regions
from baldwinlab.parts.world_features import ItemRegion

# Maximum number of items of a region that is always a single cell.
MAX_UNSORTED_ITEMS: Final = 8 * WIDTH
# Average number of items in a cell.
ITEMS_PER_CELL: Final = 4
# Height of a cell, in widths. The items of a row of cells are contiguous in memory.
# A scan therefore tests few rows, and narrow cells contain few items out of reach.
CELL_HEIGHT_RATIO: Final = 3
# Maximum fraction of a region's area that an agent scans.
# Above this fraction, a scan of all items is faster.
MAX_SCANNED_FRACTION: Final = 0.25
# From this number of agents on, the maximum fraction is doubled, because agents share the sorting.
MANY_AGENTS: Final = 12
# Half the diagonal of a square, as a multiple of half a side.
SQUARE_DIAGONAL: Final = 1.4142135623730951
# A distance is multiplied by the factor, and the margin (a length) is added, to cover rounding.
ROUNDING_FACTOR: Final = 1.001
ROUNDING_MARGIN: Final = 0.25


@compiled
def compute_cell_size(width: float, height: float, count: int) -> Any:
    """Return the width and height of a cell of a region with `count` items.

    With at least `ITEMS_PER_CELL` items, a cell is at most as wide and as high as the region.
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

    Return 1 if the region is a single cell, because sorting the items does not save time.
    """
    cell_width, cell_height = compute_cell_size(width, height, count)
    scanned_area = min(width, 2 * radius + cell_width) * min(height, 2 * radius + cell_height)
    max_scanned_area = MAX_SCANNED_FRACTION * width * height * (2 if agents >= MANY_AGENTS else 1)
    # `>=` instead of `>`, because both areas of a tiny region are rounded to 0.
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


class GridSettings(NamedTuple):
    """Visual range and number of agents, which determine the grid cells of a region."""

    visual_radius: float
    agents: int


def grid_settings(experiment: Experiment) -> GridSettings:
    """Return the grid settings of an experiment with one species."""
    return GridSettings(
        visual_radius=experiment.senses.visual_radius, agents=experiment.agents_per_world
    )


def _region_size(region: ItemRegion) -> tuple[float, float]:
    """Return the width and height of a region."""
    return region.x[1] - region.x[0], region.y[1] - region.y[0]


def _grid_shape(region: ItemRegion, grid: GridSettings) -> tuple[int, int]:
    """Return the numbers of columns and rows of the grid of a region."""
    return compute_grid_shape(*_region_size(region), region.count, *grid)


def count_cells(region: ItemRegion, grid: GridSettings) -> int:
    """Return the number of grid cells of a region."""
    return math.prod(_grid_shape(region, grid))


def describe_regions(experiment: Experiment, margin: float, grid: GridSettings) -> dict[str, Any]:
    """Return the arrays of `MiniWorldModel` that describe regions of items and grids, by field."""
    world = experiment.world
    regions = item_regions(experiment)
    kinds = item_kinds(experiment)
    rectangles = []
    for region in regions:
        width, height = _region_size(region)
        rectangles.append((region.x[0], width, region.y[0], height))
    # `reshape` gives the arrays columns even if there are no regions.
    rectangle_array = np.array(rectangles, np.float32).reshape(-1, 4)
    widths_and_heights = rectangle_array[:, 1::2]
    grid_shapes = [_grid_shape(region, grid) for region in regions]
    grid_shape_array = np.array(grid_shapes, np.int64).reshape(-1, 2)
    images = [
        count_images(*_region_size(region), margin, world.width, world.height) for region in regions
    ]
    return {
        "region_kind": np.array([kinds.index(region.kind) for region in regions], np.int64),
        "regions": rectangle_array,
        "region_items": np.cumsum([0, *(region.count for region in regions)], dtype=np.int64),
        "region_cells": np.cumsum([0, *grid_shape_array.prod(axis=1)], dtype=np.int64),
        "grid": grid_shape_array,
        "cell_size": (widths_and_heights / grid_shape_array).astype(np.float32),
        "images": np.array(images, np.int64),
    }


def estimate_scanned_items(experiment: Experiment) -> int:
    """Return the approximate number of items that an agent scans in a step."""
    # The sequential update sorts all items again after each agent that eats, so all items count.
    is_sequential = experiment.lifetime.update == "sequential"
    radius, agents = grid_settings(experiment)
    scanned_items = 0
    for region in item_regions(experiment):
        fraction = scanned_fraction(*_region_size(region), region.count, radius, agents)
        scanned_items += region.count if is_sequential else math.ceil(region.count * fraction)
    return scanned_items
