"""Tests of time and of the keyboard in the World tab: meals, generations, focus and names."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import Browser, Page, expect

from baldwinlab.simulation.replay import replay
from tests.lab.client import LabServer, get_json, read_box
from tests.small_studies import shorten_preset

LIFE = "study=small&condition=evo%2Bself-taught/A&run=1&generation=2"
EARLIER_LIFE = "study=small&condition=evo/A&run=1&generation=1&step=10"


def test_without_a_run_in_the_address_the_typical_run_plays_in_some_seconds(
    page: Page, lab_server: LabServer
) -> None:
    typical = get_json(lab_server.address, "results", study="small")["typical_run"]
    for condition in ("evo/A", "evo+self-taught/A"):
        page.goto("about:blank")
        page.goto(f"/#/world?study=small&condition={condition.replace('+', '%2B')}")
        expect(page.locator("[data-ready]")).to_have_count(1)
        expect(page.get_by_test_id("run-a")).to_have_value(str(typical[condition]))
        expect(page.get_by_test_id("generation-a")).to_have_value("2")
    expect(page.get_by_test_id("speed")).to_have_value("5")
    expect(page.get_by_test_id("step")).to_have_text("299 / 299")
    expect(page.get_by_test_id("play")).to_have_attribute("data-playing", "false")


@pytest.mark.parametrize("agent", [None, 4], ids=["any agent", "the open agent"])
def test_the_next_and_the_previous_meals_are_those_of_the_replay(
    page: Page, agent: int | None
) -> None:
    eaten = replay(shorten_preset(), seed=5, run=1, generation=2).eaten
    eaten = eaten.sum("agent") if agent is None else eaten.isel(agent=agent)
    meals = (eaten.values > 0).nonzero()[0].tolist()
    page.goto(f"/#/world?{LIFE}&step={meals[0]}" + ("" if agent is None else f"&agent={agent}"))
    expect(page.get_by_test_id("step")).to_have_text(f"{meals[0]} / 299")
    for step in meals[1:4]:
        page.keyboard.press("n")
        expect(page.get_by_test_id("step")).to_have_text(f"{step} / 299")
    for step in meals[:3][::-1][: len(meals) - 1]:
        page.get_by_test_id("mealBefore").click()
        expect(page.get_by_test_id("step")).to_have_text(f"{step} / 299")
    page.keyboard.press("End")
    page.keyboard.press("n")
    expect(page.get_by_test_id("message-info")).to_contain_text("Nothing is eaten after this step.")


@pytest.mark.nightly
def test_generations_play_and_stop_at_the_last_one(page: Page) -> None:
    page.goto(f"/#/world?{LIFE}&step=200&speed=1000")
    expect(page.locator("[data-ready]")).to_have_count(1)
    play_all = page.get_by_test_id("play-all-a")
    with (
        page.expect_response(re.compile("recording.*generation=0")),
        page.expect_response(re.compile("recording.*generation=2")),
    ):
        play_all.click()
    expect(play_all).to_have_attribute("aria-pressed", "false")
    expect(page.get_by_test_id("generation-a")).to_have_value("2")
    expect(page.get_by_test_id("step")).to_have_text("299 / 299")


@pytest.mark.nightly
def test_tooltips_describe_the_agent_and_the_step_at_the_pointer(page: Page) -> None:
    page.goto(f"/#/world?{LIFE}&step=0")
    expect(page.locator("[data-ready]")).to_have_count(1)
    box = read_box(page.get_by_test_id("world-a"))
    scale = min(box["width"], box["height"]) * 0.94
    left = box["x"] + (box["width"] - scale) / 2
    top = box["y"] + (box["height"] - scale) / 2
    first = replay(shorten_preset(), seed=5, run=1, generation=2).isel(step=0)
    trace = first.isel(agent=7)
    page.mouse.move(left + float(trace.x) / 640 * scale, top + float(trace.y) / 640 * scale)
    expect(page.locator(".stage .tip")).to_have_text("agent 7, 0 items eaten")
    page.get_by_test_id("timeline").hover(position={"x": 8, "y": 10})
    expect(page.locator(".timeline .tip")).to_have_text(
        f"step 0: {int(first.eaten.sum())} items eaten"
    )
    expect(page.locator(".stage .tip")).to_be_hidden()


def test_keys_in_the_generation_slider_change_the_generation_only(page: Page) -> None:
    page.goto(f"/#/world?{EARLIER_LIFE}")
    slider = page.get_by_role("slider", name="Generation")
    slider.press("ArrowRight")
    expect(page.get_by_test_id("generation-a")).to_have_value("2")
    slider.press("Home")
    expect(page.get_by_test_id("generation-a")).to_have_value("0")
    expect(page.get_by_test_id("step")).to_have_text("10 / 299")
    page.get_by_role("slider", name="Step").press("ArrowRight")
    expect(page.get_by_test_id("step")).to_have_text("11 / 299")


def test_the_focus_moves_to_an_opened_agent_and_escape_returns_it(page: Page) -> None:
    page.goto(f"/#/world?{EARLIER_LIFE}")
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
    page.goto(f"/#/world?{EARLIER_LIFE}")
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
