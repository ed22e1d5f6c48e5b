"""Tests of the map of behavior: its points are the measured numbers, and open lifetimes."""

from __future__ import annotations

from playwright.sync_api import Page, expect

from tests.axe import find_violations
from tests.lab.client import SMALL, LabServer, get_json

LIFE = "study=small&condition=evo%2Bself-taught/A&run=1&generation=2&step=0"


def open_map(page: Page, state: str = LIFE) -> None:
    page.goto(f"/#/world?{state}")
    expect(page.locator("[data-ready]")).to_have_count(1)
    page.get_by_test_id("behavior").click()


def test_points_are_the_measured_numbers_and_a_point_opens_its_agent(
    page: Page, lab_server: LabServer
) -> None:
    open_map(page)
    measured = get_json(lab_server.address, "behavior", **SMALL)
    points = page.get_by_test_id("behavior-plot").locator("circle")
    expect(points).to_have_count(20)
    for agent, (innate, learned) in enumerate(
        zip(measured["innate"], measured["learned"], strict=True)
    ):
        expect(points.nth(agent)).to_have_attribute(
            "aria-label", f"agent {agent}: {innate:g} without learning, {learned:g} with learning"
        )
    assert find_violations(page) == []
    # Equal points cover each other, so the keyboard selects one.
    points.first.focus()
    for _ in range(3):
        page.keyboard.press("ArrowRight")
    page.keyboard.press("Enter")
    expect(page.get_by_test_id("agent")).to_have_text("Agent 3")


def test_a_mean_opens_its_generation(page: Page) -> None:
    open_map(page)
    page.get_by_test_id("behavior-kind").select_option("generations")
    points = page.get_by_test_id("behavior-plot").locator("circle")
    expect(points).to_have_count(3)
    points.first.press("Enter")
    expect(page.get_by_test_id("generation-a")).to_have_value("0")


def test_agents_that_do_not_learn_have_an_explanation(page: Page) -> None:
    open_map(page, LIFE.replace("evo%2Bself-taught/A", "evo/A"))
    expect(page.get_by_test_id("message-error")).to_contain_text("Choose a condition that learns.")
