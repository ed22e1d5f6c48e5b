"""Tests of the first screen: it shows the start button, and then the world, in every window."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from baldwinlab.lab.export import render_live_page
from baldwinlab.papers import presets
from tests.lab.client import LabServer
from tests.lab.test_page_export import shorten

SIZES = {
    "desktop": (1280, 800),
    "laptop": (1366, 768),
    "large laptop": (1440, 900),
    "large desktop": (1920, 1080),
    "phone": (390, 844),
    "phone in landscape": (844, 390),
    "small phone": (360, 640),
    "desktop at 200 %": (640, 400),
}
PORTRAIT = SIZES["phone"]
LANDSCAPE = SIZES["phone in landscape"]
LIFE = "study=small&condition=evo%2Bself-taught/A&run=1&generation=2&step=0"
# The minimum edge of a map, in px.
MIN_EDGE = 240

# Return the number of uncovered rows in the middle column of an element inside the window. With the
# module of worlds, the rows are those of the map, which a canvas draws with a margin.
ROWS = """async (element, module) => {
    const { left, width, top, height } = element.getBoundingClientRect();
    let edge = height;
    if (module) {
        const { WorldView } = await import(module);
        const scale = Object.getOwnPropertyDescriptor(WorldView.prototype, "scale").get;
        const world = { width: 640, height: 640 };
        edge = 640 * scale.call({ width, height, camera: { zoom: 1 }, world });
    }
    const x = left + width / 2;
    const first = top + (height - edge) / 2;
    const elementAt = (_, row) => document.elementFromPoint(x, first + row + 0.5);
    const rows = Array.from({ length: Math.floor(edge) }, elementAt);
    return rows.filter(visible => visible && element.contains(visible)).length;
}"""


@pytest.fixture(scope="module")
def exported_address(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Export a page, and return its address."""
    path: Path = tmp_path_factory.mktemp("export") / "laboratory.html"
    path.write_bytes(render_live_page([shorten(presets.load("evo+self-taught/A"))]))
    return path.as_uri()


@pytest.fixture
def touch_page(browser: Browser, lab_server: LabServer) -> Iterator[Page]:
    """Yield a blank page of a first visit, with a touch screen."""
    with lab_server.context(browser, has_touch=True) as context:
        yield context.new_page()


def resize(page: Page, size: tuple[int, int]) -> None:
    page.set_viewport_size({"width": size[0], "height": size[1]})


def check_start_button(page: Page, sizes: list[tuple[int, int]]) -> None:
    """Check the size of the start button, and that it is completely visible."""
    start = page.get_by_test_id("start")
    for size in sizes:
        resize(page, size)
        box = start.bounding_box()
        assert box is not None and box["width"] >= 100 and box["height"] >= 44, size
        assert box["x"] >= 0 and box["x"] + box["width"] <= size[0], size
        assert start.evaluate(ROWS) == int(box["height"]), size


def check_start_button_with_and_without_guide(page: Page) -> None:
    expect(page.get_by_test_id("start")).to_be_enabled()
    expect(page.get_by_test_id("guide")).to_be_visible()
    check_start_button(page, list(SIZES.values()))
    page.get_by_test_id("close-guide").click()
    expect(page.get_by_test_id("guide")).to_be_hidden()
    check_start_button(page, list(SIZES.values()))
    resize(page, PORTRAIT)
    page.locator(".form summary").last.scroll_into_view_if_needed()
    check_start_button(page, [PORTRAIT])


def test_start_is_on_the_first_screen_of_the_lab(touch_page: Page) -> None:
    touch_page.goto("/#/live?preset=evo%2Bself-taught/A")
    check_start_button_with_and_without_guide(touch_page)


def test_start_is_on_the_first_screen_of_an_exported_page(
    touch_page: Page, exported_address: str
) -> None:
    touch_page.goto(exported_address)
    check_start_button_with_and_without_guide(touch_page)


@pytest.mark.parametrize(
    "size",
    [
        *(PORTRAIT, SIZES["desktop at 200 %"]),
        *(pytest.param(size, marks=pytest.mark.nightly) for size in (LANDSCAPE, SIZES["desktop"])),
    ],
    ids=str,
)
def test_the_world_is_on_the_first_screen_after_start_and_the_guide_closes(
    touch_page: Page, exported_address: str, size: tuple[int, int]
) -> None:
    resize(touch_page, size)
    touch_page.goto(f"{exported_address}#/live?runs=1")
    expect(touch_page.get_by_test_id("guide")).to_be_visible()
    touch_page.get_by_test_id("start").click()
    expect(touch_page.get_by_test_id("live-canvas-count")).to_contain_text("of 20 ate")
    expect(touch_page.get_by_test_id("guide")).to_be_hidden()
    expect(touch_page.get_by_test_id("live-play")).to_be_in_viewport(ratio=1)
    assert touch_page.get_by_test_id("live-canvas").evaluate(ROWS, "lab/world.js") >= MIN_EDGE
    touch_page.get_by_test_id("about").click()
    expect(touch_page.get_by_test_id("guide")).to_be_visible()


@pytest.mark.parametrize(
    "size",
    [
        pytest.param(PORTRAIT, id="portrait"),
        pytest.param(LANDSCAPE, id="landscape", marks=pytest.mark.nightly),
    ],
)
def test_the_world_of_a_live_run_is_on_the_first_screen_of_a_phone(
    touch_page: Page, size: tuple[int, int]
) -> None:
    resize(touch_page, size)
    changes = '{"lifetime.steps":300,"evolution.generations":2}'
    touch_page.goto(f"/#/live?preset=evo%2Bself-taught/A&runs=1&set={changes}")
    touch_page.get_by_test_id("start").click()
    expect(touch_page.get_by_test_id("live-canvas-count")).to_contain_text("of 20 ate")
    expect(touch_page.get_by_test_id("guide")).to_be_hidden()
    assert touch_page.get_by_test_id("live-canvas").evaluate(ROWS, "/world.js") >= MIN_EDGE


def test_the_world_tab_shows_the_map_in_every_window_and_two_maps_on_a_phone(
    touch_page: Page,
) -> None:
    touch_page.goto(f"/#/world?{LIFE}")
    expect(touch_page.locator("[data-ready]")).to_have_count(1)
    touch_page.get_by_test_id("close-guide").click()
    for size in SIZES.values():
        resize(touch_page, size)
        assert touch_page.get_by_test_id("world-a").evaluate(ROWS, "/world.js") >= MIN_EDGE, size
    resize(touch_page, LANDSCAPE)
    touch_page.goto(f"/#/world?{LIFE}&b.condition=evo/A")
    expect(touch_page.locator("[data-ready]")).to_have_count(2)
    for name in "ab":
        assert touch_page.get_by_test_id(f"world-{name}").evaluate(ROWS, "/world.js") >= MIN_EDGE
        condition = touch_page.get_by_test_id(f"condition-{name}")
        expect(condition).to_be_in_viewport(ratio=1)
        assert condition.evaluate(ROWS) > 30
