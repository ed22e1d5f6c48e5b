"""Tests of the keyboard and of screen readers: focus, names and announcements."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import Browser, Page, expect

from baldwinlab.simulation.replay import replay
from tests.lab.client import LabServer
from tests.small_studies import shorten_preset

LIFE = "study=small&condition=evo/A&run=1&generation=1&step=10"


def test_keys_in_the_generation_slider_change_the_generation_only(page: Page) -> None:
    page.goto(f"/#/world?{LIFE}")
    slider = page.get_by_role("slider", name="Generation")
    slider.press("ArrowRight")
    expect(page.get_by_test_id("generation-a")).to_have_value("2")
    slider.press("Home")
    expect(page.get_by_test_id("generation-a")).to_have_value("0")
    expect(page.get_by_test_id("step")).to_have_text("10 / 299")
    page.get_by_role("slider", name="Step").press("ArrowRight")
    expect(page.get_by_test_id("step")).to_have_text("11 / 299")


def test_the_focus_moves_to_an_opened_agent_and_escape_returns_it(page: Page) -> None:
    page.goto(f"/#/world?{LIFE}")
    line = page.get_by_test_id("agent-3")
    line.press("Enter")
    inspector = page.get_by_role("region", name="Agent inspector")
    expect(inspector).to_be_focused()
    expect(page.get_by_test_id("relatives")).to_contain_text("parents")
    page.get_by_test_id("parent").first.press("Enter")
    expect(page.get_by_test_id("generation-a")).to_have_value("0")
    expect(inspector).to_be_focused()
    page.keyboard.press("[")
    page.keyboard.press("Escape")
    expect(inspector).to_be_hidden()
    assert page.evaluate("document.activeElement.matches('.agent-line, canvas')")


def test_the_button_of_an_agent_has_a_name_and_the_step_is_not_announced(
    page: Page,
) -> None:
    page.goto(f"/#/world?{LIFE}")
    expect(page.get_by_role("button", name="agent 0, 0 items eaten")).to_be_visible()
    page.keyboard.press("End")
    eaten = int(
        replay(shorten_preset("evo/A"), seed=5, run=1, generation=1).eaten.isel(agent=0).sum()
    )
    expect(
        page.get_by_role("button", name=re.compile(f"^agent 0, {eaten} items? eaten$"))
    ).to_be_visible()
    announcer = page.evaluate(
        """document.querySelector("[data-testid=step]")
            .closest("output, [aria-live], [role=status]")"""
    )
    assert announcer is None


@pytest.mark.nightly
def test_with_reduced_motion_a_lifetime_starts_with_a_click(
    browser: Browser, lab_server: LabServer
) -> None:
    with lab_server.open_page(browser, reduced_motion="reduce") as page:
        page.goto("/")
        expect(page.locator("[data-ready]")).to_have_count(2)
        expect(page.get_by_test_id("play")).to_have_attribute("data-playing", "false")
        expect(page.get_by_test_id("step")).to_have_text("0 / 299")
        page.get_by_test_id("play").click()
        expect(page.get_by_test_id("step")).not_to_have_text("0 / 299")
