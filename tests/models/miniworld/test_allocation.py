"""What is allocated follows from how much there is, not from where it lies."""

from __future__ import annotations

import pytest

from baldwinlab.models.miniworld.allocation import array_dimensions
from baldwinlab.models.miniworld.grid import ITEMS_PER_CELL
from tests.small_studies import shorten_preset


@pytest.mark.parametrize("thin", [1e-9, 1e-3, 1, 1000, 1_000_000])
@pytest.mark.parametrize("count", [200, 5000])
@pytest.mark.parametrize("upright", [False, True])
def test_a_strip_however_thin_has_no_more_cells_than_its_items_fill(
    thin: float, count: int, upright: bool
) -> None:
    along, across = ("y", "x") if upright else ("x", "y")
    sight, food = (
        {"visual_radius": 1e-4},
        {along: [0, 1_000_000], across: [0, thin], "count": count},
    )
    experiment = shorten_preset().replace(
        world={"width": 1_000_000, "height": 1_000_000, "food": [food]}, senses=sight
    )
    assert 1 <= array_dimensions(experiment)["cells"] <= 2 * count / ITEMS_PER_CELL
