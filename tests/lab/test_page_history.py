"""Tests of the curve at the generation slider and of ancestors."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.axe import find_violations
from tests.lab.client import SMALL, LabServer, get_json, read_box
from tests.lab.conftest import run_server

LIFE = "study=small&condition=evo%2Bself-taught/A&run=1&generation=2&step=0"
RUN = {name: SMALL[name] for name in ("study", "condition", "run")}
LIVE = {"lifetime.steps": 300, "world.start.x": 400, "evolution.generations": 3}


def generation_text(server: LabServer, generation: int) -> re.Pattern[str]:
    """Return the text that describes a generation, with rounded numbers."""
    curve = get_json(server.address, "run", **RUN)
    best, mean = (f"{curve[which][generation]:.3g}" for which in ("best", "mean"))
    numbers = rf"best {re.escape(best)}, average {re.escape(mean)}\d?"
    return re.compile(rf"^generation {generation}, food eaten: {numbers}$")


@pytest.mark.nightly
def test_the_curve_describes_generations_and_selects_them_by_click_and_drag(
    page: Page, lab_server: LabServer
) -> None:
    page.goto(f"/#/world?{LIFE}")
    slider = page.get_by_role("slider", name="Generation")
    generation = page.get_by_test_id("generation-a")
    expect(slider).to_have_attribute("aria-valuetext", generation_text(lab_server, 2))
    box = read_box(slider)
    assert 28 <= box["height"] <= 40
    first, middle, last = (box["x"] + 8 + share * (box["width"] - 16) for share in (0, 0.5, 1))
    height = box["y"] + box["height"] / 2
    page.mouse.move(middle, height)
    expect(page.locator(".run-curve .tip")).to_have_text(generation_text(lab_server, 1))
    expect(page.locator(".run-curve .tip")).to_be_in_viewport(ratio=1)
    page.mouse.click(first, height)
    expect(generation).to_have_value("0")
    expect(slider).to_have_attribute("aria-valuetext", generation_text(lab_server, 0))
    page.mouse.down()
    page.mouse.move(last, height, steps=4)
    expect(generation).to_have_value("2")
    page.mouse.up()
    # The history does not contain the generations during the drag.
    page.go_back()
    expect(generation).to_have_value("0")
    slider.press("End")
    expect(generation).to_have_value("2")
    page.get_by_test_id("run-a").select_option("0")
    expect(slider).not_to_have_attribute("aria-valuetext", generation_text(lab_server, 2))
    page.get_by_test_id("compare").click()
    expect(page.get_by_role("slider", name="Generation")).to_have_count(2)
    expect(page.locator(".run-curve:not(.plain)")).to_have_count(2)
    # Two worlds next to each other are narrow in this window.
    page.set_viewport_size({"width": 900, "height": 800})
    for curve in page.locator(".run-curve").all():
        expect(curve).to_be_visible()
        box = read_box(curve)
        assert box["width"] >= 60


@pytest.mark.nightly
def test_a_tap_selects_a_generation_and_a_preset_has_no_curve(
    browser: Browser, lab_server: LabServer, tmp_path: Path
) -> None:
    with lab_server.open_page(
        browser, viewport={"width": 390, "height": 844}, has_touch=True
    ) as page:
        page.goto(f"{lab_server.entry}#/world?{LIFE}")
        expect(page.locator(".run-curve:not(.plain)")).to_have_count(1)
        box = read_box(page.locator(".run-curve"))
        assert 28 <= box["height"] <= 40
        page.touchscreen.tap(box["x"] + 9, box["y"] + box["height"] / 2)
        expect(page.get_by_test_id("generation-a")).to_have_value("0")
        with run_server(tmp_path) as empty:
            page.goto(f"{empty.entry}#/world?condition=evo%2Bself-taught/A&generation=0")
            expect(page.locator("[data-ready]")).to_have_count(1)
            expect(page.locator(".run-curve.plain")).to_have_count(1)
            expect(page.get_by_role("slider", name="Generation")).not_to_have_attribute(
                "aria-valuetext", re.compile(".")
            )


def rows_of(line: dict[str, Any]) -> list[list[str]]:
    """Return the table of ancestors without the agent, the last generation first."""
    columns = zip(
        line["agents"],
        line["eaten"],
        line["partners"],
        line["eaten_by_partners"],
        line["ancestors"],
        strict=False,
    )
    rows = []
    for generation, (fitter, eaten, second, second_eaten, number) in enumerate(columns):
        second_cell = "the same" if second == fitter else f"agent {second}{second_eaten}"
        rows.append([str(generation), f"agent {fitter}{eaten}", second_cell, str(number)])
    return rows[::-1]


def test_the_list_of_ancestors_starts_in_generation_0_and_opens_their_lifetimes(
    page: Page, lab_server: LabServer
) -> None:
    line = get_json(lab_server.address, "ancestors", **SMALL, agent=3)
    page.goto(f"/#/world?{LIFE}&agent=3")
    toggle = page.get_by_test_id("ancestors-of")
    title = page.get_by_test_id("agent")
    generation = page.get_by_test_id("generation-a")
    toggle.press("Enter")
    expect(toggle).to_have_attribute("aria-pressed", "true")
    expect(page.get_by_test_id("relatives")).to_be_hidden()
    rows = page.get_by_test_id("ancestors").locator("tbody tr")
    expect(rows).to_have_count(2)
    assert [
        [cell.text_content() for cell in row.locator("th, td").all()] for row in rows.all()
    ] == rows_of(line)
    expect(page).to_have_url(re.compile("inside=ancestors"))
    page.reload()
    expect(rows).to_have_count(2)
    rows.last.get_by_role("button", name=f"agent {line['agents'][0]}, generation 0").first.press(
        "Enter"
    )
    expect(title).to_have_text(f"Agent {line['agents'][0]}")
    expect(generation).to_have_value("0")
    expect(page.get_by_test_id("ancestors")).to_contain_text(
        "This agent has no parents: its weights are random."
    )
    expect(page.get_by_role("region", name="Agent inspector")).to_be_focused()
    page.go_back()
    expect(title).to_have_text("Agent 3")
    expect(rows).to_have_count(2)
    chart = page.get_by_role("img", name="items eaten by the ancestors")
    width = chart.evaluate("canvas => canvas.clientWidth")
    chart.click(position={"x": 34 + (width - 40) / 2, "y": 40})
    expect(title).to_have_text(f"Agent {line['agents'][1]}")
    expect(generation).to_have_value("1")
    toggle.click()
    expect(page.get_by_test_id("relatives")).to_be_visible()
    expect(page).not_to_have_url(re.compile("inside="))


@pytest.mark.nightly
def test_the_inspector_lists_the_ancestors_in_a_live_run(page: Page) -> None:
    page.goto(f"/#/live?preset=evo/A&runs=1&pace=0&set={quote(json.dumps(LIVE), safe='')}")
    page.get_by_test_id("start").click()
    expect(page.get_by_test_id("live-state")).to_have_text("Done")
    address = page.url.replace("#/live?", "#/live?generation=2&step=5&agent=4&inside=ancestors&")
    page.goto("about:blank")
    page.goto(address)
    expect(page.get_by_test_id("ancestors").locator("tbody tr")).to_have_count(2)
    page.get_by_test_id("ancestor").last.click()
    expect(page.get_by_test_id("live-caption")).to_have_text("Generation 0")


def test_the_lineage_tree_opens_the_lifetimes_of_relatives(
    page: Page, lab_server: LabServer
) -> None:
    tree = get_json(lab_server.address, "lineage", **SMALL, agent=3)
    page.goto(f"/#/world?{LIFE}&agent=3&inside=ancestors")
    nodes = page.get_by_test_id("lineage").get_by_role("button")
    expect(nodes).to_have_count(sum(len(row["agents"]) for row in tree["rows"]))
    assert find_violations(page) == []
    parent = tree["rows"][-2]["agents"][0]
    nodes.first.focus()
    for _ in tree["rows"][0]["agents"]:
        page.keyboard.press("ArrowRight")
    # The first agent of the next generation, which is that of the parents.
    page.keyboard.press("Enter")
    expect(page.get_by_test_id("agent")).to_have_text(f"Agent {parent}")
    expect(page.get_by_test_id("generation-a")).to_have_value("1")
