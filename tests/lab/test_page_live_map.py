"""Tests of the map of a live run: the pointer moves, draws and removes shapes."""

from __future__ import annotations

import json
from typing import Any
from urllib.parse import parse_qs

from playwright.sync_api import Page, expect

from tests.axe import find_violations
from tests.lab.client import read_box, wait_for

# Origin and scale of the map in the canvas, in CSS pixels.
GEOMETRY = """async canvas => {
  const { WorldView } = await import("/world/world_view.js");
  const { origin, scale } = new WorldView(canvas);
  return [...origin, scale];
}"""
Point = tuple[int, int]


def read_changes(page: Page) -> dict[str, Any]:
    """Return the changed settings in the address."""
    (text,) = parse_qs(page.url.partition("?")[2]).get("set", ["{}"])
    return dict(json.loads(text))


def drag(page: Page, start: Point, end: Point) -> None:
    """Drag from a position on the map to another one, in units of length."""
    canvas = page.locator(".live-preview")
    box = read_box(canvas)
    left, top, scale = canvas.evaluate(GEOMETRY)

    def move(x: int, y: int) -> None:
        page.mouse.move(box["x"] + left + x * scale, box["y"] + top + y * scale)

    move(*start)
    page.mouse.down()
    move(*end)
    page.mouse.up()


def choose(page: Page, tool: str) -> None:
    page.get_by_test_id("map-tools").get_by_label(tool, exact=True).check()


def test_food_walls_and_the_start_follow_the_pointer(page: Page) -> None:
    page.goto("/#/live?preset=evo/A")
    expect(page.locator(".live-preview")).to_be_visible()
    expect(page.get_by_test_id("start")).to_be_enabled()
    drag(page, (480, 160), (480, 500))
    food = [{"x": [400, 560], "y": [420, 580], "count": 50, "energy": 1}]
    wait_for(page, lambda: read_changes(page) == {"world.food": food})
    drag(page, (160, 160), (160, 400))
    moved = {"world.food": food, "world.start.y": 400}
    wait_for(page, lambda: read_changes(page) == moved)
    choose(page, "Add wall")
    # Edges are on a grid of 10, and a wall is at least 20 thick.
    drag(page, (301, 299), (304, 500))
    walls = {"world.features": ["walls"], "world.walls.boxes": [[300, 320, 300, 500]]}
    wait_for(page, lambda: read_changes(page) == moved | walls)
    expect(page.get_by_test_id("start")).to_be_enabled()
    assert find_violations(page) == []
    # The address restores the map.
    page.reload()
    expect(page.get_by_test_id("field-world.start.y")).to_have_value("400")
    expect(page.get_by_test_id("start")).to_be_enabled()
    choose(page, "Remove")
    drag(page, (310, 400), (310, 400))
    wait_for(page, lambda: read_changes(page) == moved)


def test_a_shape_stays_on_the_map(page: Page) -> None:
    page.goto("/#/live?preset=evo/A")
    expect(page.locator(".live-preview")).to_be_visible()
    expect(page.get_by_test_id("start")).to_be_enabled()
    drag(page, (480, 160), (630, 10))
    wait_for(page, lambda: "world.food" in read_changes(page))
    (food,) = read_changes(page)["world.food"]
    assert (food["x"], food["y"]) == ([480, 640], [0, 160])
    choose(page, "Add food")
    drag(page, (100, 500), (200, 600))
    wait_for(page, lambda: len(read_changes(page)["world.food"]) == 2)
    assert read_changes(page)["world.food"][1]["y"] == [500, 600]
