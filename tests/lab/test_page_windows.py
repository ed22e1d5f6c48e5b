"""Tests of the freezer, "Is it innate?" and the lineage tree in every window."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from tests.axe import find_violations
from tests.lab.client import LabServer

LIFE = "study=small&condition=evo%2Bself-taught/A&run=1&generation=2&step=0"
pytestmark = pytest.mark.nightly
# Width, height, and device pixels per CSS pixel. (640, 400, 2) is 1280 x 800 at 200 %.
SIZES = [
    (320, 568, 2),
    (390, 844, 3),
    (640, 400, 2),
    (768, 1024, 1),
    (1280, 800, 1),
    (1920, 1080, 1),
]


@pytest.fixture(params=SIZES, ids=str)
def page(browser: Browser, freezer: LabServer, request: pytest.FixtureRequest) -> Iterator[Page]:
    width, height, dots = request.param
    with freezer.open_page(
        browser,
        viewport={"width": width, "height": height},
        device_scale_factor=dots,
        color_scheme="dark",
        reduced_motion="reduce",
    ) as page:
        yield page


def check_width(page: Page) -> None:
    """Check that nothing is wider than the window."""
    excess = """() => Math.max(
        document.documentElement.scrollWidth - innerWidth,
        ...[...document.querySelectorAll("main, dialog[open], .inside")].map(
            ({ scrollWidth, clientWidth }) => scrollWidth - clientWidth))"""
    assert page.evaluate(excess) <= 0


def check_dialog(page: Page, dialog: Locator) -> None:
    expect(dialog).to_be_in_viewport(ratio=0.95)
    check_width(page)
    assert find_violations(page) == []
    dialog.get_by_role("button", name="Close", exact=True).click()
    expect(dialog).to_have_count(0)


def test_nothing_is_cut_off_or_a_barrier(page: Page) -> None:
    page.goto(f"/#/world?{LIFE}&b.condition=evo/A")
    expect(page.locator("[data-ready]")).to_have_count(2)
    # With reduced motion, nothing plays.
    expect(page.get_by_test_id("play")).to_have_attribute("aria-label", "Play")
    check_width(page)
    assert find_violations(page) == []
    page.get_by_test_id("behavior").click()
    expect(page.get_by_test_id("behavior-plot").locator("circle")).to_have_count(3)
    check_width(page)
    assert find_violations(page) == []
    page.goto(f"/#/world?{LIFE}&agent=3&inside=ancestors")
    expect(page.get_by_test_id("lineage").locator("svg")).to_be_visible()
    check_width(page)
    assert find_violations(page) == []
    page.goto("/#/live")
    page.get_by_test_id("live-more").locator("summary").click()
    page.get_by_test_id("freezer").click()
    check_dialog(page, page.get_by_role("dialog", name="Freezer"))
    page.get_by_test_id("schedule").scroll_into_view_if_needed()
    expect(page.get_by_test_id("schedule")).to_be_visible()
    check_width(page)
    page.goto("/#/world?study=nowhere")
    expect(page.get_by_test_id("missing-lifetime")).to_be_visible()
    check_width(page)
    assert find_violations(page) == []
