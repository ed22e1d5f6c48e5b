"""The map is never smaller than 240 px, in whatever window: where there is no room for all, the page scrolls."""

from __future__ import annotations

from typing import Any

import pytest
from playwright.sync_api import Browser, expect

from tests.lab.conftest import LabServer

LIFE = "study=small&condition=evo%2Bself-taught/A&run=1&generation=2&step=0"
WINDOWS = {
    "desk": (1280, 800, 1),
    "phone": (390, 844, 3),
    "phone on its side": (844, 390, 3),
    "a desk at 200 %": (640, 400, 2),
    "the narrowest": (320, 568, 2),
}

# The map's shorter edge in each world; how much wider the page is than its window; what no scrolling of the view would reach.
MEASURE = """async () => {
    const { WorldView } = await import("/world.js");
    const scale = Object.getOwnPropertyDescriptor(WorldView.prototype, "scale").get;
    const maps = [...document.querySelectorAll(".stage canvas")].map(canvas => 640 * scale.call(
        { width: canvas.clientWidth, height: canvas.clientHeight, camera: { zoom: 1 }, world: { width: 640, height: 640 } }));
    const view = document.getElementById("view"), page = document.documentElement;
    const wide = [view.scrollWidth - view.clientWidth, page.scrollWidth - innerWidth];
    return { maps, wide, below: page.scrollHeight - innerHeight };
}"""


def measured(page: Any) -> dict[str, Any]:
    found: dict[str, Any] = page.evaluate(MEASURE)
    return found


@pytest.mark.parametrize(("width", "height", "dots"), WINDOWS.values(), ids=WINDOWS)
def test_maps_have_room_alone_in_comparison_and_beside_an_agent(
    browser: Browser, lab_server: LabServer, width: int, height: int, dots: int
) -> None:
    size = {"width": width, "height": height}
    touch = width < 1000
    with browser.new_context(base_url=lab_server.address, viewport=size, device_scale_factor=dots, has_touch=touch) as context:  # type: ignore[arg-type]
        page = context.new_page()
        page.goto(f"/#/world?{LIFE}")
        expect(page.locator("[data-ready]")).to_have_count(1)
        for more, worlds in ((None, 1), ("close-guide", 1), ("compare", 2), ("agents", 2), ("agent-3", 2)):
            if more is not None:
                page.get_by_test_id(more).click()
            expect(page.locator("[data-ready]")).to_have_count(worlds)
            found = measured(page)
            assert len(found["maps"]) == worlds and min(found["maps"]) >= 240, (more, found)
            assert found["wide"] == [0, 0] and found["below"] <= 0, (more, found)
        expect(page.get_by_test_id("play")).to_be_in_viewport()
        page.get_by_test_id("close-agent").click()
        page.get_by_test_id("fit").scroll_into_view_if_needed()
        expect(page.get_by_test_id("fit")).to_be_in_viewport()
