"""Test that the allocated memory depends on the number of items, not on the shape of regions."""

from __future__ import annotations

import pytest

from baldwinlab.models.miniworld.allocation import array_dimensions
from baldwinlab.models.miniworld.grid import ITEMS_PER_CELL
from tests.small_studies import shorten_preset


@pytest.mark.parametrize("width", [1e-9, 1e-3, 1, 1000, 1_000_000])
@pytest.mark.parametrize("count", [200, 5000])
@pytest.mark.parametrize("is_vertical", [False, True])
def test_the_number_of_cells_of_a_narrow_region_depends_on_its_number_of_items(
    width: float, count: int, is_vertical: bool
) -> None:
    long_axis, short_axis = ("y", "x") if is_vertical else ("x", "y")
    food = {long_axis: [0, 1_000_000], short_axis: [0, width], "count": count}
    experiment = shorten_preset().replace(
        world={"width": 1_000_000, "height": 1_000_000, "food": [food]},
        senses={"visual_radius": 1e-4},
    )
    assert 1 <= array_dimensions(experiment)["cells"] <= 2 * count / ITEMS_PER_CELL
