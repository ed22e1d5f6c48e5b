"""Tests of the first screen: pictures, the start button and few words, in every window."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from baldwinlab.lab.pages.export import render_live_page
from baldwinlab.papers import presets
from tests.lab.client import LabServer, read_box
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

MAX_WORDS = 80
# The minimum edge of a button on a touch screen, in px.
MIN_TARGET = 44

# Return the words that are visible in the window, with the selected options. The banner of a server
# that answers late, and links to live runs that other tests have begun, are not part of the screen.
WORDS = """() => {
    const LIVE_RUNS = "[data-testid=live-empty] a";
    const EXCLUDED = `option, script, .visually-hidden, #connection, ${LIVE_RUNS}`;
    const isVisible = ({ x, y, width, height }) =>
        width > 0 && x >= 0 && x + width / 2 < innerWidth && y >= 0 && y + height / 2 < innerHeight;
    const words = [];
    const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    while (walker.nextNode()) {
        const { currentNode: node } = walker;
        const { parentElement: parent } = node;
        if (!parent.checkVisibility() || parent.closest(EXCLUDED))
            continue;
        for (const { 0: word, index } of node.data.matchAll(/\\S*[\\p{L}\\p{N}]\\S*/gu)) {
            const range = document.createRange();
            range.setStart(node, index);
            range.setEnd(node, index + word.length);
            if (isVisible(range.getBoundingClientRect())) words.push(word);
        }
    }
    const lists = [...document.querySelectorAll("select")].filter(list => list.checkVisibility());
    const selected = lists.filter(list => isVisible(list.getBoundingClientRect()));
    return [...words, ...selected.map(list => list.selectedOptions[0]?.textContent ?? "")];
}"""

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
    with lab_server.open_page(browser, has_touch=True) as page:
        yield page


def resize(page: Page, size: tuple[int, int]) -> None:
    page.set_viewport_size({"width": size[0], "height": size[1]})


def check_start_button(page: Page) -> None:
    """Check in all windows that the start button is completely visible, and not on the map."""
    start = page.get_by_test_id("start")
    expect(start).to_be_enabled()
    first_map = page.locator(".live-preview, [data-testid=contrast] .stage").first
    expect(first_map).to_be_visible()
    for size in SIZES.values():
        resize(page, size)
        box = read_box(start)
        assert box["width"] >= 100 and box["height"] >= MIN_TARGET, size
        assert start.evaluate(ROWS) == int(box["height"]), size
        picture = read_box(first_map)
        is_beside = (
            box["x"] + box["width"] <= picture["x"] or picture["x"] + picture["width"] <= (box["x"])
        )
        assert is_beside or picture["y"] + picture["height"] <= box["y"], size
    resize(page, PORTRAIT)
    page.locator(".form summary").last.scroll_into_view_if_needed()
    assert start.evaluate(ROWS) >= MIN_TARGET
    page.evaluate("document.querySelector('main').scrollTo(0, 0)")


def check_words(page: Page) -> None:
    """Check the number of words on the first screen of a computer and of a phone."""
    for size in (SIZES["desktop"], PORTRAIT):
        resize(page, size)
        words = page.evaluate(WORDS)
        assert len(words) <= MAX_WORDS, (size, " ".join(words))


def test_start_covers_no_map_of_the_lab_and_first_screens_have_few_words(touch_page: Page) -> None:
    touch_page.goto("/#/live")
    check_start_button(touch_page)
    check_words(touch_page)
    touch_page.goto("/#/results")
    expect(touch_page.get_by_test_id("curves").locator("canvas").first).to_be_visible()
    check_words(touch_page)
    touch_page.goto("/#/papers")
    expect(touch_page.locator(".paper-card").first).to_be_visible()
    check_words(touch_page)


def test_an_exported_page_opens_with_two_playing_worlds_and_start(
    touch_page: Page, exported_address: str
) -> None:
    touch_page.goto(exported_address)
    expect(touch_page.get_by_test_id("question")).to_contain_text("Do agents that learn")
    expect(touch_page.get_by_test_id("contrast-play")).to_have_attribute("aria-label", "Pause")
    check_start_button(touch_page)
    check_words(touch_page)
    # Another preset or setting shows its map.
    touch_page.get_by_test_id("field-name").fill("mine")
    expect(touch_page.locator(".live-preview")).to_be_visible()
    expect(touch_page.get_by_test_id("contrast")).to_have_count(0)


@pytest.mark.parametrize(
    "size",
    [
        PORTRAIT,
        *(
            pytest.param(SIZES[name], marks=pytest.mark.nightly)
            for name in ("desktop", "phone in landscape", "desktop at 200 %")
        ),
    ],
    ids=str,
)
def test_the_world_is_on_the_first_screen_after_start(
    touch_page: Page, exported_address: str, size: tuple[int, int]
) -> None:
    resize(touch_page, size)
    touch_page.goto(f"{exported_address}#/live?runs=1")
    touch_page.get_by_test_id("start").click()
    expect(touch_page.get_by_test_id("live-canvas-count")).to_contain_text("of 20 ate")
    expect(touch_page.get_by_test_id("live-play")).to_be_in_viewport(ratio=1)
    assert (
        touch_page.get_by_test_id("live-canvas").evaluate(ROWS, "lab/world/world_view.js")
        >= MIN_EDGE
    )


def test_the_world_tab_opens_with_learners_and_controls_of_the_newest_study(
    touch_page: Page, lab_server: LabServer
) -> None:
    # Other tests of this server create studies.
    later = time.time() + 1000
    record = next((lab_server.root / "small").rglob("*.nc"))
    os.utime(record, (later, later))
    resize(touch_page, SIZES["desktop"])
    touch_page.goto("/")
    expect(touch_page.locator("[data-ready]")).to_have_count(2)
    expect(touch_page.get_by_test_id("condition-a")).to_have_value("evo+self-taught/A")
    expect(touch_page.get_by_test_id("condition-b")).to_have_value("evo/A")
    expect(touch_page.get_by_test_id("world-a-count")).to_contain_text("learns · ")
    expect(touch_page.get_by_test_id("world-b-count")).to_contain_text("cannot learn · ")
    expect(touch_page.get_by_test_id("question")).to_have_text(
        "Do agents that learn during life eat more than agents that cannot?"
    )
    check_words(touch_page)
    touch_page.get_by_test_id("speed").select_option("1000")
    expect(touch_page.get_by_test_id("lead-note")).to_contain_text("evo+self-taught/A: ")
    touch_page.get_by_test_id("watch-next").click()
    for name in "ab":
        expect(touch_page.get_by_test_id(f"generation-{name}")).to_have_value("0")


def test_results_show_the_answer_with_few_words_in_every_window(touch_page: Page) -> None:
    touch_page.goto("/#/results?study=small")
    touch_page.get_by_test_id("curves").locator("canvas").first.wait_for()
    expect(touch_page.get_by_test_id("answer")).to_contain_text("items eaten")
    for size in SIZES.values():
        resize(touch_page, size)
        expect(touch_page.get_by_test_id("answer")).to_be_in_viewport(ratio=1)
        words = touch_page.evaluate(WORDS)
        assert len(words) <= MAX_WORDS, (size, " ".join(words))


def test_the_world_tab_shows_the_map_in_every_window_and_two_maps_on_a_phone(
    touch_page: Page,
) -> None:
    touch_page.goto(f"/#/world?{LIFE}")
    expect(touch_page.locator("[data-ready]")).to_have_count(1)
    for size in SIZES.values():
        resize(touch_page, size)
        assert (
            touch_page.get_by_test_id("world-a").evaluate(ROWS, "/world/world_view.js") >= MIN_EDGE
        ), size
    resize(touch_page, LANDSCAPE)
    touch_page.goto(f"/#/world?{LIFE}&b.condition=evo/A")
    expect(touch_page.locator("[data-ready]")).to_have_count(2)
    for name in "ab":
        assert (
            touch_page.get_by_test_id(f"world-{name}").evaluate(ROWS, "/world/world_view.js")
            >= MIN_EDGE
        )
    # The controls are in a column next to the maps.
    for name in ("play", "condition-a"):
        expect(touch_page.get_by_test_id(name)).to_be_in_viewport(ratio=1)
