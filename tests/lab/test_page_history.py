"""The past of what is shown: the curve of its run under the generation slider, and an agent's ancestors in the inspector."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any
from urllib.parse import quote

from playwright.sync_api import Browser, Page, expect

from tests.lab.client import SMALL, LabServer, get_json
from tests.lab.conftest import run_server

LIFE = "study=small&condition=evo%2Bself-taught/A&run=1&generation=2&step=0"
RUN = {name: SMALL[name] for name in ("study", "condition", "run")}
LIVE = {"lifetime.steps": 300, "world.start.x": 400, "evolution.generations": 3}


def told(server: LabServer, generation: int) -> re.Pattern[str]:
    """What is said of a generation: the numbers as the page rounds them."""
    curve = get_json(server.address, "run", **RUN)
    best, mean = (f"{curve[which][generation]:.3g}" for which in ("best", "mean"))
    return re.compile(
        rf"^generation {generation}, food eaten: best {re.escape(best)}, average {re.escape(mean)}\d?$"
    )


def test_the_curve_tells_of_each_generation_and_goes_where_it_is_pressed_or_drawn(
    page: Page, lab_server: LabServer
) -> None:
    page.goto(f"/#/world?{LIFE}")
    slider, generation = (
        page.get_by_role("slider", name="Generation"),
        page.get_by_test_id("generation-a"),
    )
    expect(slider).to_have_attribute("aria-valuetext", told(lab_server, 2))
    place = slider.bounding_box()
    assert place is not None and 28 <= place["height"] <= 40
    first, middle, last = (place["x"] + 8 + share * (place["width"] - 16) for share in (0, 0.5, 1))
    height = place["y"] + place["height"] / 2
    page.mouse.move(middle, height)
    expect(page.locator(".run-curve .tip")).to_have_text(told(lab_server, 1))
    expect(page.locator(".run-curve .tip")).to_be_in_viewport(ratio=1)
    page.mouse.click(first, height)
    expect(generation).to_have_value("0")
    expect(slider).to_have_attribute("aria-valuetext", told(lab_server, 0))
    page.mouse.down()
    page.mouse.move(last, height, steps=4)
    expect(generation).to_have_value("2")
    page.mouse.up()
    page.go_back()  # past all that was passed on the way
    expect(generation).to_have_value("0")
    slider.press("End")
    expect(generation).to_have_value("2")
    page.get_by_test_id("run-a").select_option("0")
    expect(slider).not_to_have_attribute("aria-valuetext", told(lab_server, 2))
    page.get_by_test_id("compare").click()
    expect(page.get_by_role("slider", name="Generation")).to_have_count(2)
    expect(page.locator(".run-curve:not(.plain)")).to_have_count(2)
    page.set_viewport_size(
        {"width": 900, "height": 800}
    )  # where two stand side by side with little room
    for curve in page.locator(".run-curve").all():
        expect(curve).to_be_visible()
        place = curve.bounding_box()
        assert place is not None and place["width"] >= 60


def test_a_finger_goes_to_a_generation_and_a_preset_which_is_not_stored_has_no_curve(
    browser: Browser, lab_server: LabServer, tmp_path: Path
) -> None:
    with lab_server.context(
        browser, viewport={"width": 390, "height": 844}, has_touch=True
    ) as context:
        page = context.new_page()
        page.goto(f"{lab_server.entry}#/world?{LIFE}")
        page.get_by_test_id("close-guide").tap()
        expect(page.locator(".run-curve:not(.plain)")).to_have_count(1)
        place = page.locator(".run-curve").bounding_box()
        assert place is not None and 28 <= place["height"] <= 40
        page.touchscreen.tap(place["x"] + 9, place["y"] + place["height"] / 2)
        expect(page.get_by_test_id("generation-a")).to_have_value("0")
        with run_server(tmp_path) as empty:
            page.goto(f"{empty.entry}#/world?condition=evo%2Bself-taught/A&generation=0")
            expect(page.locator("[data-ready]")).to_have_count(1, timeout=60_000)
            expect(page.locator(".run-curve.plain")).to_have_count(1)
            expect(page.get_by_role("slider", name="Generation")).not_to_have_attribute(
                "aria-valuetext", re.compile(".")
            )


def rows_of(line: dict[str, Any]) -> list[list[str]]:
    """A row for each ancestor but the agent itself, the youngest first."""
    columns = zip(
        line["agents"],
        line["eaten"],
        line["partners"],
        line["eaten_by_partners"],
        line["ancestors"],
        strict=False,
    )
    rows = []
    for generation, (fitter, eaten, other, ate, number) in enumerate(columns):
        beside = "the same" if other == fitter else f"agent {other}{ate}"
        rows.append([str(generation), f"agent {fitter}{eaten}", beside, str(number)])
    return rows[::-1]


def test_ancestors_are_listed_back_to_the_first_generation_and_each_opens_its_life(
    page: Page, lab_server: LabServer
) -> None:
    line = get_json(lab_server.address, "ancestors", **SMALL, agent=3)
    page.goto(f"/#/world?{LIFE}&agent=3")
    turner, title, generation = (
        page.get_by_test_id(name) for name in ("ancestors-of", "agent", "generation-a")
    )
    turner.press("Enter")
    expect(turner).to_have_attribute("aria-pressed", "true")
    expect(page.get_by_test_id("kin")).to_be_hidden()
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
    chart = page.get_by_role("img", name="food eaten by the ancestors")
    width = chart.evaluate("canvas => canvas.clientWidth")
    chart.click(position={"x": 34 + (width - 40) / 2, "y": 40})
    expect(title).to_have_text(f"Agent {line['agents'][1]}")
    expect(generation).to_have_value("1")
    turner.click()
    expect(page.get_by_test_id("kin")).to_be_visible()
    expect(page).not_to_have_url(re.compile("inside="))


def test_the_ancestors_of_an_agent_of_a_live_run_are_there_as_well(page: Page) -> None:
    page.goto(f"/#/live?preset=evo/A&runs=1&pace=0&set={quote(json.dumps(LIVE), safe='')}")
    page.get_by_test_id("start").click()
    expect(page.get_by_test_id("live-state")).to_have_text("Done", timeout=60_000)
    address = page.url.replace("#/live?", "#/live?generation=2&step=5&agent=4&inside=ancestors&")
    page.goto("about:blank")
    page.goto(address)
    expect(page.get_by_test_id("ancestors").locator("tbody tr")).to_have_count(2)
    page.get_by_test_id("ancestor").last.click()
    expect(page.get_by_test_id("live-caption")).to_have_text("Generation 0")
