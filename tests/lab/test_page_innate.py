"""Tests of "Is it innate?" in the Results tab: the map of behavior, and its sentence."""

from __future__ import annotations

import re

from playwright.sync_api import Page, expect

from tests.axe import find_violations
from tests.lab.client import SMALL, LabServer, get_json

LIFE = "study=small&condition=evo%2Bself-taught/A&run=1&generation=2&step=0"
MAP = "/#/results?study=small&tab=innate&condition=evo%2Bself-taught/A&run=1"


def test_the_tab_shows_the_measured_means_of_the_typical_run_and_the_sentence(
    page: Page, lab_server: LabServer
) -> None:
    page.goto("/#/results?study=small")
    page.get_by_test_id("results-tab-innate").click()
    run = get_json(lab_server.address, "results", study="small")["typical_run"][SMALL["condition"]]
    expect(page.get_by_test_id("innate-run")).to_have_value(str(run))
    measured = get_json(
        lab_server.address, "behavior", of="generations", **SMALL | {"run": str(run)}
    )
    expect(page.get_by_test_id("innate-answer")).to_have_text(measured["answer"])
    # The method is folded.
    method = page.get_by_test_id("innate-method")
    expect(method.locator("p")).to_be_hidden()
    method.locator("summary").press("Enter")
    expect(method.locator("p")).to_contain_text("Each agent is simulated twice")
    points = page.get_by_test_id("behavior-plot").locator("circle")
    pairs = zip(measured["innate"], measured["learned"], strict=True)
    for generation, (innate, learned) in enumerate(pairs):
        label = points.nth(generation).get_attribute("aria-label")
        assert label is not None
        numbers = [float(number) for number in re.findall(r"[\d.]+", label)]
        assert numbers[0] == generation
        assert abs(numbers[1] - innate) < 0.006 and abs(numbers[2] - learned) < 0.006
    assert find_violations(page) == []
    # The address restores the tab and the run.
    page.get_by_test_id("innate-run").select_option(str(1 - run))
    expect(page.get_by_test_id("innate-answer")).to_contain_text(f"of run {1 - run}")
    page.reload()
    expect(page.get_by_test_id("innate-run")).to_have_value(str(1 - run))
    page.get_by_test_id("results-tab-comparison").click()
    expect(page.get_by_test_id("curves")).to_be_visible()


def test_a_mean_opens_its_generation(page: Page) -> None:
    page.goto(MAP)
    points = page.get_by_test_id("behavior-plot").locator("circle")
    expect(points).to_have_count(3)
    points.first.press("Enter")
    expect(page.get_by_test_id("generation-a")).to_have_value("0")
    expect(page.get_by_test_id("run-a")).to_have_value("1")


def test_the_point_of_an_agent_opens_this_agent(page: Page) -> None:
    page.goto(MAP)
    page.get_by_test_id("behavior-kind").select_option("agents")
    points = page.get_by_test_id("behavior-plot").locator("circle")
    expect(points).to_have_count(20)
    # Equal points cover each other, so the keyboard selects one.
    points.first.focus()
    for _ in range(3):
        page.keyboard.press("ArrowRight")
    page.keyboard.press("Enter")
    expect(page.get_by_test_id("agent")).to_have_text("Agent 3")
    expect(page.get_by_test_id("generation-a")).to_have_value("2")


def test_the_world_opens_the_map_of_its_run(page: Page) -> None:
    page.goto(f"/#/world?{LIFE}")
    expect(page.locator("[data-ready]")).to_have_count(1)
    page.get_by_test_id("behavior").click()
    expect(page.get_by_test_id("innate-condition")).to_have_value("evo+self-taught/A")
    expect(page.get_by_test_id("innate-run")).to_have_value("1")


def test_agents_that_do_not_learn_have_an_explanation(page: Page) -> None:
    page.goto(f"/#/world?{LIFE.replace('evo%2Bself-taught/A', 'evo/A')}")
    expect(page.locator("[data-ready]")).to_have_count(1)
    page.get_by_test_id("behavior").click()
    expect(page.get_by_test_id("message-error")).to_contain_text("Choose a condition that learns.")
