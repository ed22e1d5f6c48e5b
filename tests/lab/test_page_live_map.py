"""Tests of the map of a live run: the pointer moves, draws and removes shapes."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any
from urllib.parse import parse_qs

import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from tests.axe import find_violations
from tests.lab.client import LabServer, draw_frames, read_box, repeat_until, wait_for

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


def find_position(canvas: Locator, point: Point) -> tuple[float, float]:
    """Return the position of a point of the map in the window."""
    box = read_box(canvas)
    left, top, scale = canvas.evaluate(GEOMETRY)
    return box["x"] + left + point[0] * scale, box["y"] + top + point[1] * scale


def drag(page: Page, start: Point, end: Point) -> None:
    """Drag from a position on the map to another one, in units of length."""
    canvas = page.locator(".live-preview")
    page.mouse.move(*find_position(canvas, start))
    page.mouse.down()
    page.mouse.move(*find_position(canvas, end))
    page.mouse.up()


def swipe(page: Page, start: Point, end: Point) -> None:
    """Swipe with a finger from a position on the map to another one."""
    canvas = page.locator(".live-preview")
    (x, y), (last_x, last_y) = find_position(canvas, start), find_position(canvas, end)
    session = page.context.new_cdp_session(page)

    def touch(kind: str, *points: dict[str, float]) -> None:
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": list(points)})

    touch("touchStart", {"x": x, "y": y})
    for share in (0.2, 0.4, 0.6, 0.8, 1):
        touch("touchMove", {"x": x + share * (last_x - x), "y": y + share * (last_y - y)})
    touch("touchEnd")
    draw_frames(page)


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


@pytest.fixture
def phone(browser: Browser, lab_server: LabServer) -> Iterator[Page]:
    viewport = {"width": 390, "height": 844}
    with lab_server.open_page(browser, viewport=viewport, has_touch=True) as page:
        page.goto("/#/live?preset=evo/A")
        expect(page.locator(".live-preview")).to_be_visible()
        expect(page.get_by_test_id("start")).to_be_enabled()
        yield page


def test_a_finger_scrolls_the_page_from_empty_places_and_moves_shapes(phone: Page) -> None:
    main = phone.locator("main")
    swipe(phone, (100, 500), (100, 300))
    wait_for(phone, lambda: main.evaluate("main => main.scrollTop") > 0)
    assert read_changes(phone) == {}

    def move_food() -> None:
        main.evaluate("main => main.scrollTo(0, 0)")
        draw_frames(phone)
        swipe(phone, (480, 160), (480, 400))

    repeat_until(lambda: "world.food" in read_changes(phone), move_food)
    assert read_changes(phone)["world.food"][0]["y"] == [320, 480]
    choose(phone, "Add wall")
    draw_frames(phone)
    # The choice of a tool can scroll it into view.
    position = main.evaluate("main => main.scrollTop")

    def draw_wall() -> None:
        main.evaluate("(main, top) => main.scrollTo(0, top)", position)
        draw_frames(phone)
        swipe(phone, (100, 300), (140, 500))

    repeat_until(lambda: "world.walls.boxes" in read_changes(phone), draw_wall)
    assert main.evaluate("main => main.scrollTop") == position
