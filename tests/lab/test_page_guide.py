"""Tests of the guide of each tab, and of the state that tabs preserve."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.lab.client import LabServer

LIFE = "study=small&condition=evo/A&run=1&generation=1"


def test_what_is_this_opens_few_sentences_and_the_definition_of_the_baldwin_effect(
    page: Page,
) -> None:
    page.goto(f"/#/world?{LIFE}&step=0")
    expect(page.locator("[data-ready]")).to_have_count(1)
    guide = page.get_by_test_id("guide")
    expect(guide).to_be_hidden()
    page.get_by_test_id("about").click()
    summary = guide.locator(".guide-words > p")
    assert len(re.findall(r"[.?!](?: |$)", summary.inner_text())) <= 3
    page.get_by_test_id("guide-details").locator("summary").click()
    text = guide.inner_text()
    assert "evo/A, run 1, generation 1, of the study small" in text
    assert "20 agents are born in the dashed circle and live 300 steps." in text
    assert "Three binary inputs: food in the left, front and right sector." in text
    assert "Three actions: turn left, go forward, turn right." in text
    assert "No learning: the weights do not change during life." in text
    # The address contains the open text.
    expect(page).to_have_url(re.compile("guide=open"))
    page.get_by_test_id("baldwin-effect").click()
    expect(summary).to_contain_text("In the Baldwin effect, learning changes the course of")
    expect(page).to_have_url(re.compile("guide=baldwin"))
    guide.press("Escape")
    expect(guide).to_be_hidden()
    expect(page.get_by_test_id("baldwin-effect")).to_be_focused()


def test_every_tab_links_the_definition_of_the_baldwin_effect(page: Page) -> None:
    for tab in ("papers", "live", "results"):
        page.goto(f"/#/{tab}")
        page.get_by_test_id("baldwin-effect").click()
        expect(page.get_by_test_id("guide")).to_contain_text("the behavior becomes innate")


@pytest.mark.nightly
def test_tabs_preserve_the_study_the_lifetime_the_step_and_the_scroll_position(page: Page) -> None:
    page.goto(f"/#/world?{LIFE}&step=120&agent=4")
    expect(page.get_by_test_id("agent")).to_have_text("Agent 4")
    page.get_by_test_id("tab-results").click()
    expect(page).to_have_url(re.compile(r"#/results\?study=small"))
    page.set_viewport_size({"width": 1280, "height": 500})
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
    with lab_server.open_page(
        browser, viewport={"width": 390, "height": 844}, has_touch=True
    ) as page:
        page.goto(f"/#/world?{LIFE.replace('evo/A', 'evo%2Bself-taught/A')}&step=0")
        page.get_by_test_id("agents").tap()
        page.get_by_test_id("agent-2").tap()
        expect(page.get_by_test_id("agent")).to_have_text("Agent 2")
        page.get_by_test_id("about").tap()
        page.get_by_test_id("guide-details").locator("summary").tap()
        guide = page.get_by_test_id("guide")
        expect(guide).to_contain_text("evo+self-taught/A, run 1, generation 1")
        expect(guide).to_contain_text("active sensor")
