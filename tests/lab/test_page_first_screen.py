"""The first screen shows Start, and the world once a run has started, in a window of whatever size."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from baldwinlab.lab.export import live_page
from baldwinlab.papers import presets
from tests.lab.client import LabServer
from tests.lab.test_page_export import quick

SIZES = {
    "desk": (1280, 800),
    "laptop": (1366, 768),
    "large laptop": (1440, 900),
    "large desk": (1920, 1080),
    "phone": (390, 844),
    "phone on its side": (844, 390),
    "small phone": (360, 640),
    "desk at 200 %": (640, 400),
}
PORTRAIT, LANDSCAPE = SIZES["phone"], SIZES["phone on its side"]
LIFE = "study=small&condition=evo%2Bself-taught/A&run=1&generation=2&step=0"
LEAST = 240  # px of the map's edge

# How many rows of an element's middle column nothing covers, and no edge of the window cuts off: of a button, or, where the
# module of worlds is given, of the map that a canvas draws with a margin.
ROWS = """async (element, module) => {
    const { left, width, top, height } = element.getBoundingClientRect();
    let edge = height;
    if (module) {
        const { WorldView } = await import(module);
        const scale = Object.getOwnPropertyDescriptor(WorldView.prototype, "scale").get;
        edge = 640 * scale.call({ width, height, camera: { zoom: 1 }, world: { width: 640, height: 640 } });
    }
    const [x, first] = [left + width / 2, top + (height - edge) / 2];
    const rows = Array.from({ length: Math.floor(edge) }, (_, row) => document.elementFromPoint(x, first + row + 0.5));
    return rows.filter(there => there && element.contains(there)).length;
}"""


@pytest.fixture(scope="module")
def export(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The address of an exported page."""
    path: Path = tmp_path_factory.mktemp("export") / "laboratory.html"
    path.write_bytes(live_page([quick(presets.load("evo+self-taught/A"))]))
    return path.as_uri()


@pytest.fixture
def visitor(browser: Browser, lab_server: LabServer) -> Iterator[Page]:
    """A page of a first visit, which shows "What is this?"."""
    with lab_server.context(browser, has_touch=True) as context:
        yield context.new_page()


def resize(page: Page, size: tuple[int, int]) -> None:
    page.set_viewport_size({"width": size[0], "height": size[1]})


def require_start_in_sight(page: Page, sizes: list[tuple[int, int]]) -> None:
    start = page.get_by_test_id("start")
    for size in sizes:
        resize(page, size)
        box = start.bounding_box()
        assert box is not None and box["width"] >= 100 and box["height"] >= 44, size
        assert box["x"] >= 0 and box["x"] + box["width"] <= size[0], size
        assert start.evaluate(ROWS) == int(box["height"]), size


def require_start_in_sight_with_the_guide_open_and_shut(page: Page) -> None:
    expect(page.get_by_test_id("start")).to_be_enabled()
    expect(page.get_by_test_id("guide")).to_be_visible()
    require_start_in_sight(page, list(SIZES.values()))
    page.get_by_test_id("close-guide").click()
    expect(page.get_by_test_id("guide")).to_be_hidden()
    require_start_in_sight(page, list(SIZES.values()))
    resize(page, PORTRAIT)
    page.locator(".form summary").last.scroll_into_view_if_needed()
    require_start_in_sight(page, [PORTRAIT])


def test_start_is_on_the_first_screen_of_the_lab(visitor: Page) -> None:
    visitor.goto("/#/live?preset=evo%2Bself-taught/A")
    require_start_in_sight_with_the_guide_open_and_shut(visitor)


def test_start_is_on_the_first_screen_of_an_exported_page(visitor: Page, export: str) -> None:
    visitor.goto(export)
    require_start_in_sight_with_the_guide_open_and_shut(visitor)


@pytest.mark.parametrize(
    "size", [PORTRAIT, LANDSCAPE, SIZES["desk at 200 %"], SIZES["desk"]], ids=str
)
def test_the_world_is_on_the_first_screen_after_start_and_the_guide_makes_room(
    visitor: Page, export: str, size: tuple[int, int]
) -> None:
    resize(visitor, size)
    visitor.goto(f"{export}#/live?runs=1")
    expect(visitor.get_by_test_id("guide")).to_be_visible()
    visitor.get_by_test_id("start").click()
    expect(visitor.get_by_test_id("live-canvas-count")).to_contain_text("of 20 ate")
    expect(visitor.get_by_test_id("guide")).to_be_hidden()
    expect(visitor.get_by_test_id("live-play")).to_be_in_viewport(ratio=1)
    assert visitor.get_by_test_id("live-canvas").evaluate(ROWS, "lab/world.js") >= LEAST
    visitor.get_by_test_id("about").click()
    expect(visitor.get_by_test_id("guide")).to_be_visible()  # whenever it is asked for


@pytest.mark.parametrize("size", [PORTRAIT, LANDSCAPE], ids=["portrait", "landscape"])
def test_a_live_run_of_the_lab_shows_its_world_on_a_phone_s_first_screen(
    visitor: Page, size: tuple[int, int]
) -> None:
    resize(visitor, size)
    visitor.goto(
        '/#/live?preset=evo%2Bself-taught/A&runs=1&set={"lifetime.steps":300,"evolution.generations":2}'
    )
    visitor.get_by_test_id("start").click()
    expect(visitor.get_by_test_id("live-canvas-count")).to_contain_text("of 20 ate")
    expect(visitor.get_by_test_id("guide")).to_be_hidden()
    assert visitor.get_by_test_id("live-canvas").evaluate(ROWS, "/world.js") >= LEAST


def test_the_world_tab_shows_the_map_in_every_window_and_both_of_a_comparison_on_a_phone(
    visitor: Page,
) -> None:
    visitor.goto(f"/#/world?{LIFE}")
    expect(visitor.locator("[data-ready]")).to_have_count(1)
    visitor.get_by_test_id("close-guide").click()
    for size in SIZES.values():
        resize(visitor, size)
        assert visitor.get_by_test_id("world-a").evaluate(ROWS, "/world.js") >= LEAST, size
    resize(visitor, LANDSCAPE)
    visitor.goto(f"/#/world?{LIFE}&b.condition=evo/A")
    expect(visitor.locator("[data-ready]")).to_have_count(2)
    for name in "ab":
        assert visitor.get_by_test_id(f"world-{name}").evaluate(ROWS, "/world.js") >= LEAST
        condition = visitor.get_by_test_id(f"condition-{name}")
        expect(condition).to_be_in_viewport(ratio=1)
        assert condition.evaluate(ROWS) > 30
