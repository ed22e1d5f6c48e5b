"""Tests of the layout: maps have at least 240 px, and controls are reachable."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.lab.client import WINDOWS, LabServer, every_window, get_response

LIFE = "study=small&condition=evo%2Bself-taught/A&run=1&generation=2&step=0"
LOW = [WINDOWS[name] for name in ("phone in landscape", "desktop at 200 %", "smallest phone")]

# Return the shorter edge of each map, the excess width of the page in px, the names of controls
# that stay covered after scrolling, and the number of controls.
MEASURE = """async module => {
    const { WorldView } = await import(module);
    const scale = Object.getOwnPropertyDescriptor(WorldView.prototype, "scale").get;
    const camera = { zoom: 1 };
    const world = { width: 640, height: 640 };
    const edge = ({ clientWidth: width, clientHeight: height }) =>
        640 * scale.call({ width, height, camera, world });
    const canvases = [...document.querySelectorAll(".stage canvas")];
    const maps = canvases.map(edge);
    const view = document.querySelector("main");
    const page = document.documentElement;
    const wide = [view.scrollWidth - view.clientWidth, page.scrollWidth - innerWidth];
    const covered = control => {
        control.scrollIntoView({ block: "center" });
        const { left, top, width, height } = control.getBoundingClientRect();
        const top_element = document.elementFromPoint(left + width / 2, top + height / 2);
        const group = control.closest("label, .chart-slider");
        return !(control.contains(top_element) || group?.contains(top_element));
    };
    const all = [...document.querySelectorAll("button, select, input, summary, a[href]")];
    const controls = all.filter(control => control.checkVisibility());
    const name = control => control.dataset.testid || control.ariaLabel || control.textContent;
    const lost = controls.filter(covered).map(name);
    return { maps, wide, lost, controls: controls.length };
}"""


@contextmanager
def open_window(
    browser: Browser, width: int, height: int, dots: int, lab: LabServer | None = None
) -> Iterator[Page]:
    """Yield a page in a window of this size. With a lab, its context has the token."""
    options: dict[str, Any] = {
        "viewport": {"width": width, "height": height},
        "device_scale_factor": dots,
        "has_touch": width < 1000,
    }
    with lab.context(browser, **options) if lab else browser.new_context(**options) as context:
        yield context.new_page()


def check_page_layout(page: Page, maps: int, module: str = "/world/world_view.js") -> None:
    """Check the size of the maps, the width of the page, and the controls."""
    check_layout(page.evaluate(MEASURE, module), maps)


def check_layout(layout: dict[str, Any], maps: int) -> None:
    """Check the result of `MEASURE`, with the number of maps."""
    assert len(layout["maps"]) == maps, layout
    assert min(layout["maps"]) >= 240, layout
    check_controls(layout)


def check_controls(layout: dict[str, Any]) -> None:
    """Check that the page is not wider than its window and that controls are reachable."""
    assert max(layout["wide"]) <= 0, layout
    assert layout["lost"] == [], layout
    assert layout["controls"] > 5, layout


@every_window
def test_maps_are_large_enough_with_two_worlds_an_agent_and_its_ancestors(
    browser: Browser, lab_server: LabServer, width: int, height: int, dots: int
) -> None:
    with open_window(browser, width, height, dots, lab_server) as page:
        page.goto(f"/#/world?{LIFE}")
        expect(page.locator("[data-ready]")).to_have_count(1)
        clicks = (
            (None, 1),
            ("about", 1),
            ("compare", 2),
            ("agents", 2),
            ("agent-3", 2),
            ("ancestors-of", 2),
        )
        for control, worlds in clicks:
            if control is not None:
                page.get_by_test_id(control).click()
            expect(page.locator("[data-ready]")).to_have_count(worlds)
            check_page_layout(page, worlds)
            assert page.evaluate("document.documentElement.scrollHeight <= innerHeight"), control
        expect(page.get_by_test_id("play")).to_be_in_viewport()
        page.get_by_test_id("close-agent").click()
        page.get_by_test_id("fit").scroll_into_view_if_needed()
        expect(page.get_by_test_id("fit")).to_be_in_viewport()


@pytest.mark.parametrize(
    ("view", "content"),
    [("papers", ".paper-cards > li"), ("live", "[data-testid=start]"), ("results", "canvas")],
)
def test_hidden_texts_scroll_with_their_view(page: Page, view: str, content: str) -> None:
    page.goto(f"/#/{view}")
    expect(page.locator(content).first).to_be_visible()
    # A hidden text that the page positions would make the page longer than the window.
    parents = page.locator("main .visually-hidden").evaluate_all(
        "texts => texts.map(text => text.offsetParent?.tagName)"
    )
    assert "BODY" not in parents


@pytest.mark.nightly
@pytest.mark.parametrize("n_worlds", [1, 2])
def test_the_maps_of_a_shared_page_are_large_enough(
    browser: Browser, lab_server: LabServer, tmp_path: Path, n_worlds: int
) -> None:
    lifetimes = {"a": LIFE, "b": LIFE.replace("%2Bself-taught", "")}
    query = dict(list(lifetimes.items())[:n_worlds])
    path = tmp_path / "shared.html"
    path.write_bytes(get_response(lab_server.address, "share", step=40, **query).content)
    for width, height, dots in LOW:
        with open_window(browser, width, height, dots) as page:
            page.goto(path.as_uri())
            expect(page.get_by_test_id("replay-step")).to_have_text("40 / 299")
            expect(page.get_by_test_id("replay-play")).to_be_in_viewport()
            check_page_layout(page, n_worlds, "lab/world/world_view.js")
            page.get_by_test_id("replay-canvas-agent").first.select_option("3")
            page.locator("summary").click()
            check_page_layout(page, n_worlds, "lab/world/world_view.js")


@pytest.mark.nightly
def test_the_map_of_a_live_run_is_large_enough_with_an_agent_inspector(
    browser: Browser, lab_server: LabServer
) -> None:
    changes = quote(json.dumps({"lifetime.steps": 300, "evolution.generations": 2}), safe="")
    with open_window(browser, 1280, 800, 1, lab_server) as page:
        page.goto(f"/#/live?preset=evo%2Bself-taught/A&runs=1&pace=0&set={changes}")
        page.get_by_test_id("start").click()
        expect(page.get_by_test_id("live-state")).to_have_text("Done")
        run = page.url.replace("#/live?", "#/live?generation=1&step=9&")
    for width, height, dots in LOW:
        with open_window(browser, width, height, dots, lab_server) as page:
            page.goto(run)
            expect(page.get_by_test_id("live-caption")).to_have_text("Generation 1")
            check_page_layout(page, 1)
            page.evaluate("document.querySelector('.live-world .stage').scrollIntoView()")
            expect(page.get_by_test_id("live-play")).to_be_in_viewport(ratio=1)
            page.get_by_test_id("live-canvas-agent").select_option("3")
            expect(page.get_by_test_id("relatives")).to_contain_text("parents")
            # The controls of time stay in the viewport.
            for part in ("networks", "relatives"):
                page.get_by_test_id(part).evaluate("part => part.scrollIntoView()")
                expect(page.get_by_test_id("live-play")).to_be_in_viewport(ratio=1)
            check_page_layout(page, 1)
