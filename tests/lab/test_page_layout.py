"""The map is never smaller than 240 px, in whatever window: where there is no room for all, the page scrolls to all of it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.lab.client import WINDOWS, LabServer, get_response

LIFE = "study=small&condition=evo%2Bself-taught/A&run=1&generation=2&step=0"
LOW = [WINDOWS[name] for name in ("phone on its side", "a desk at 200 %", "the narrowest")]

# The map's shorter edge in each world; how much wider the page is than its window; and the controls that no scrolling shows
# uncovered, by their names.
MEASURE = """async module => {
    const { WorldView } = await import(module);
    const scale = Object.getOwnPropertyDescriptor(WorldView.prototype, "scale").get;
    const maps = [...document.querySelectorAll(".stage canvas, .figure-stage canvas")].map(canvas => 640 * scale.call(
        { width: canvas.clientWidth, height: canvas.clientHeight, camera: { zoom: 1 }, world: { width: 640, height: 640 } }));
    const view = document.querySelector("main"), page = document.documentElement;
    const wide = [view.scrollWidth - view.clientWidth, page.scrollWidth - innerWidth];
    const covered = control => {
        control.scrollIntoView({ block: "center" });
        const { left, top, width, height } = control.getBoundingClientRect();
        const there = document.elementFromPoint(left + width / 2, top + height / 2);
        return !(control.contains(there) || control.closest("label, .chart-slider")?.contains(there));
    };
    const all = [...document.querySelectorAll("button, select, input, summary, a[href]")];
    const controls = all.filter(control => control.checkVisibility());
    const lost = controls.filter(covered).map(control => control.dataset.testid || control.ariaLabel || control.textContent);
    return { maps, wide, lost, controls: controls.length };
}"""


@contextmanager
def window(
    browser: Browser, width: int, height: int, dots: int, lab: LabServer | None = None
) -> Iterator[Page]:
    """A page in a window of this size, which may ask a lab."""
    options: dict[str, Any] = {
        "viewport": {"width": width, "height": height},
        "device_scale_factor": dots,
        "has_touch": width < 1000,
    }
    with lab.context(browser, **options) if lab else browser.new_context(**options) as context:
        yield context.new_page()


def require_room(page: Page, maps: int, module: str = "/world.js") -> None:
    """For so many maps, and for everything else."""
    require_room_in(page.evaluate(MEASURE, module), maps)


def require_room_in(found: dict[str, Any], maps: int) -> None:
    """What `MEASURE` found."""
    assert len(found["maps"]) == maps and min(found["maps"]) >= 240, found
    assert max(found["wide"]) <= 0 and found["lost"] == [] and found["controls"] > 5, found


@pytest.mark.parametrize(("width", "height", "dots"), WINDOWS.values(), ids=WINDOWS)
def test_maps_have_room_alone_in_comparison_and_beside_an_agent_and_its_ancestors(
    browser: Browser, lab_server: LabServer, width: int, height: int, dots: int
) -> None:
    with window(browser, width, height, dots, lab_server) as page:
        page.goto(f"/#/world?{LIFE}")
        expect(page.locator("[data-ready]")).to_have_count(1)
        steps = (
            (None, 1),
            ("close-guide", 1),
            ("compare", 2),
            ("agents", 2),
            ("agent-3", 2),
            ("ancestors-of", 2),
        )
        for more, worlds in steps:
            if more is not None:
                page.get_by_test_id(more).click()
            expect(page.locator("[data-ready]")).to_have_count(worlds)
            require_room(page, worlds)
            assert page.evaluate("document.documentElement.scrollHeight <= innerHeight"), more
        expect(page.get_by_test_id("play")).to_be_in_viewport()
        page.get_by_test_id("close-agent").click()
        page.get_by_test_id("fit").scroll_into_view_if_needed()
        expect(page.get_by_test_id("fit")).to_be_in_viewport()


@pytest.mark.parametrize("beside", [False, True], ids=["alone", "in comparison"])
def test_a_shared_page_has_room_for_its_maps(
    browser: Browser, lab_server: LabServer, tmp_path: Path, beside: bool
) -> None:
    one, other = LIFE, LIFE.replace("%2Bself-taught", "")
    path = tmp_path / "shared.html"
    path.write_bytes(
        get_response(
            lab_server.address, "share", a=one, step=40, **({"b": other} if beside else {})
        ).content
    )
    for width, height, dots in LOW:
        with window(browser, width, height, dots) as page:
            page.goto(path.as_uri())
            expect(page.get_by_test_id("replay-step")).to_have_text("step 40 of 300")
            expect(page.get_by_test_id("replay-play")).to_be_in_viewport()
            require_room(page, 1 + beside, "lab/world.js")
            page.get_by_test_id("replay-canvas-agent").first.select_option("3")
            page.locator("summary").click()
            require_room(page, 1 + beside, "lab/world.js")


def test_a_live_run_has_room_for_its_world_and_for_an_agent_of_it(
    browser: Browser, lab_server: LabServer
) -> None:
    changes = quote(json.dumps({"lifetime.steps": 300, "evolution.generations": 2}), safe="")
    with window(browser, 1280, 800, 1, lab_server) as page:
        page.goto(f"/#/live?preset=evo%2Bself-taught/A&runs=1&pace=0&set={changes}")
        page.get_by_test_id("start").click()
        expect(page.get_by_test_id("live-state")).to_have_text("Done", timeout=60_000)
        run = page.url.replace("#/live?", "#/live?generation=1&step=9&")
    for width, height, dots in LOW:
        with window(browser, width, height, dots, lab_server) as page:
            page.goto(run)
            expect(page.get_by_test_id("live-caption")).to_have_text("Generation 1", timeout=60_000)
            page.get_by_test_id("close-guide").click()
            require_room(page, 1)
            page.evaluate("document.querySelector('.live-world .figure-stage').scrollIntoView()")
            expect(page.get_by_test_id("live-play")).to_be_in_viewport(ratio=1)
            page.get_by_test_id("live-canvas-agent").select_option("3")
            expect(page.get_by_test_id("kin")).to_contain_text("parents")
            for part in (
                "networks",
                "kin",
            ):  # the bar of time stays in sight beside whatever is looked at
                page.get_by_test_id(part).evaluate("part => part.scrollIntoView()")
                expect(page.get_by_test_id("live-play")).to_be_in_viewport(ratio=1)
            require_room(page, 1)
