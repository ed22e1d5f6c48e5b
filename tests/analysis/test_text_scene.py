"""Lifetimes as text, for terminals."""

from __future__ import annotations

import xarray as xr

from baldwinlab.analysis.scene import Scene
from baldwinlab.analysis.text_scene import ARROWS, ITEM, MEAL, TextScene
from tests.analysis.statistics.studies import species_trace

SIZES = {"predators": 2, "prey": 3}


def make_trace() -> xr.Dataset:
    """Return a lifetime of one species."""
    return species_trace(SIZES).drop_vars(["species", "alive"])


def test_the_map_has_its_shape_and_fits_into_the_space() -> None:
    for width, height in ((80, 30), (40, 30), (200, 50)):
        text = TextScene(Scene(make_trace(), 640, 640), width, height).draw(0).plain
        lines = text.splitlines()
        assert len(lines) < height and max(map(len, lines)) <= width
        rows = [line for line in lines if line.startswith("│")]
        # A character is twice as high as it is wide.
        assert len(rows[0]) - 2 == 2 * len(rows)


def test_agents_are_at_their_position_and_point_to_their_heading() -> None:
    single = make_trace()
    single["x"][:] = 320
    single["y"][:] = 160
    single["heading"][:] = 90
    single["eaten"][:] = 0
    lines = TextScene(Scene(single, 640, 640), 84, 46).draw(0).plain.splitlines()
    rows = [line[1:-1] for line in lines if line.startswith("│")]
    positions = {
        (row, column)
        for row, line in enumerate(rows)
        for column, character in enumerate(line)
        if character in ARROWS
    }
    # y points down, and headings grow clockwise.
    assert rows[len(rows) // 4][len(rows)] == "↓"
    assert positions == {(len(rows) // 4, len(rows))}


def test_a_frame_counts_items_meals_and_living_agents() -> None:
    both = species_trace(SIZES)
    scene = TextScene(Scene(both, 640, 640), 80, 40)
    text = scene.draw(0).plain
    n_eaten = int(both["eaten"].values.sum())
    last = scene.draw(both.sizes["step"] - 1).plain
    assert f"step {both.sizes['step']} of {both.sizes['step']}: {n_eaten} eaten" in last
    assert "alive" in last and "alive" not in text
    assert 0 < text.count(ITEM) <= both.sizes["item"]


def test_a_meal_is_a_star_for_some_steps() -> None:
    single = make_trace()
    single["eaten"][:] = 0
    single["eaten"][2, 0] = 1
    scene = TextScene(Scene(single, 640, 640), 80, 40)
    assert MEAL not in scene.draw(1).plain
    assert MEAL in scene.draw(2).plain
