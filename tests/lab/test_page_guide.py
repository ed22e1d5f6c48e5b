"""Tests of the guide of each tab, and of the state that tabs preserve."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.lab.client import LabServer

LIFE = "study=small&condition=evo/A&run=1&generation=1"


def read_guide(page: Page) -> str:
    """Wait for the guide, and return its text."""
    expect(page.get_by_test_id("guide")).to_be_visible()
    return page.get_by_test_id("guide").inner_text()


def test_the_guide_of_the_world_tab_describes_its_parts_until_it_is_closed(
    first_visit: Page,
) -> None:
    page = first_visit
    page.goto(f"/#/world?{LIFE}&step=0")
    expect(page.get_by_test_id("guide")).to_contain_text("What to look for")
    guide = read_guide(page)
    assert "evo/A, run 1, generation 1, of the study small" in guide
    assert "20 agents are born in the dashed circle and live 300 steps." in guide
    assert "Three binary inputs: food in the left, front and right sector." in guide
    assert "Three actions: turn left, go forward, turn right." in guide
    assert "No learning: the weights do not change during life." in guide
    page.get_by_test_id("close-guide").click()
    expect(page.get_by_test_id("guide")).to_be_hidden()
    expect(page.get_by_test_id("about")).to_be_focused()
    page.reload()
    expect(page.locator("[data-ready]")).to_have_count(1)
    expect(page.get_by_test_id("guide")).to_be_hidden()
    page.get_by_test_id("about").press("Enter")
    expect(page).to_have_url(re.compile("guide=open"))
    page.reload()
    expect(page.get_by_test_id("guide")).to_be_visible()
    page.get_by_test_id("guide").press("Escape")
    expect(page.get_by_test_id("guide")).to_be_hidden()


@pytest.mark.nightly
@pytest.mark.parametrize("tab", ["live", "results"])
def test_the_guides_of_other_tabs_describe_the_curves(first_visit: Page, tab: str) -> None:
    page = first_visit
    page.goto(f"/#/{tab}")
    guide = read_guide(page)
    assert "The curves" in guide
    assert "What to look for" in guide
    page.get_by_test_id("close-guide").click()
    # Closing the guide of a tab does not close those of other tabs.
    page.get_by_test_id("tab-world").click()
    expect(page.get_by_test_id("guide")).to_be_visible()


@pytest.mark.nightly
def test_without_local_storage_the_guide_is_open_at_every_visit(
    first_visit: Page,
) -> None:
    page = first_visit
    page.add_init_script(
        "Object.defineProperty(globalThis, 'localStorage', { get() { throw new Error('no') } })"
    )
    page.goto(f"/#/world?{LIFE}&step=0")
    page.get_by_test_id("close-guide").click()
    page.keyboard.press("]")
    expect(page.get_by_test_id("generation-a")).to_have_value("2")
    expect(page.get_by_test_id("guide")).to_be_hidden()
    page.reload()
    expect(page.get_by_test_id("guide")).to_be_visible()


@pytest.mark.nightly
def test_tabs_preserve_the_study_the_lifetime_the_step_and_the_scroll_position(page: Page) -> None:
    page.goto(f"/#/world?{LIFE}&step=120&agent=4")
    expect(page.get_by_test_id("agent")).to_have_text("Agent 4")
    page.get_by_test_id("tab-results").click()
    expect(page).to_have_url(re.compile(r"#/results\?study=small"))
    norms = page.get_by_test_id("reaction")
    norms.scroll_into_view_if_needed()
    expect(norms).to_be_in_viewport()
    page.get_by_test_id("tab-live").click()
    page.get_by_test_id("setup-seed").fill("7")
    page.get_by_test_id("tab-world").click()
    expect(page.get_by_test_id("step")).to_have_text("120 / 299")
    expect(page.get_by_test_id("run-a")).to_have_value("1")
    expect(page.get_by_test_id("generation-a")).to_have_value("1")
    expect(page.get_by_test_id("agent")).to_have_text("Agent 4")
    # A click on the selected tab has no effect.
    page.get_by_test_id("tab-world").click()
    expect(page.get_by_test_id("step")).to_have_text("120 / 299")
    page.get_by_test_id("tab-results").click()
    expect(page.get_by_test_id("reaction")).to_be_in_viewport()
    page.get_by_test_id("tab-live").click()
    expect(page.get_by_test_id("setup-seed")).to_have_value("7")


def test_a_phone_shows_the_legend_the_agents_and_the_complete_name(
    browser: Browser, lab_server: LabServer
) -> None:
    with lab_server.context(
        browser, viewport={"width": 390, "height": 844}, has_touch=True
    ) as context:
        page = context.new_page()
        page.goto(f"/#/world?{LIFE.replace('evo/A', 'evo%2Bself-taught/A')}&step=0")
        page.get_by_test_id("close-guide").tap()
        page.get_by_test_id("agents").tap()
        page.get_by_test_id("agent-2").tap()
        expect(page.get_by_test_id("agent")).to_have_text("Agent 2")
        page.get_by_test_id("about").tap()
        guide = read_guide(page)
        assert "evo+self-taught/A, run 1, generation 1" in guide
        assert "active sensor" in guide
