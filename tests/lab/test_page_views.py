"""Tests of the World tab for models with views: grids, paths and matrices."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import Browser, Page, expect

from baldwinlab.studies.store import StudyStore
from tests.axe import find_violations
from tests.lab.client import LabServer, every_window, get_arrays
from tests.lab.test_page_layout import MEASURE, check_controls, open_window

CELLS = "study=views&condition=cells&run=1&generation=2"
MATRIX = CELLS.replace("cells", "hawks")
PATH = CELLS.replace("cells", "climbers")


@pytest.fixture
def cells_page(page: Page, views_server: LabServer) -> Page:
    """Open the lifetime of the fittest agent at its first step."""
    page.goto(f"{views_server.entry}#/world?{CELLS}&step=0")
    expect(page.locator("[data-ready]")).to_have_count(1)
    return page


def describe_step(server: LabServer, step: int, **query: int) -> str:
    """Return the text of a step. A lifetime has 20 steps in each of 6 environments."""
    _, arrays = get_arrays(
        server.address, "view", study="views", condition="cells", run=1, view="life", **query
    )
    row, column = arrays["position"][step] + 1
    direction = ("right", "down", "left", "up")[arrays["heading"][step]]
    time = f"environment {step // 20 + 1} of 6, step {step % 20 + 1} of 20"
    gain = f"gained {arrays['gained'][step]:g} in this environment so far"
    return f"{time}: row {row}, column {column}, facing {direction}; {gain}"


def test_keys_and_the_slider_change_the_step_of_a_lifetime(
    cells_page: Page, views_server: LabServer
) -> None:
    description = cells_page.get_by_test_id("grid-description")
    expect(description).to_have_text(describe_step(views_server, 0, generation=2))
    cells_page.keyboard.press("ArrowRight")
    expect(description).to_have_text(describe_step(views_server, 1, generation=2))
    cells_page.keyboard.press("Shift+ArrowRight")
    expect(description).to_have_text(describe_step(views_server, 11, generation=2))
    slider = cells_page.get_by_role("slider", name="Step")
    slider.press("End")
    expect(description).to_have_text(describe_step(views_server, 119, generation=2))
    expect(cells_page).to_have_url(re.compile("step=119"))
    slider.press("Home")
    expect(description).to_have_text(describe_step(views_server, 0, generation=2))
    play = cells_page.get_by_test_id("grid-play")
    play.click()
    expect(description).not_to_have_text(describe_step(views_server, 0, generation=2))
    play.click()
    expect(play).to_have_attribute("aria-label", "Play")


@pytest.mark.nightly
def test_the_step_stays_when_the_generation_or_the_agent_changes(
    cells_page: Page, views_server: LabServer
) -> None:
    record = StudyStore(views_server.root / "views").read("cells", 1)
    fittest = record.energy.values.argmax(axis=1)
    cells_page.keyboard.press("Shift+ArrowRight")
    heading = cells_page.get_by_test_id("view-heading")
    description = cells_page.get_by_test_id("grid-description")
    expect(heading).to_have_text(f"Life, agent {fittest[2]} (fittest), generation 2")
    cells_page.keyboard.press("[")
    expect(heading).to_have_text(f"Life, agent {fittest[1]} (fittest), generation 1")
    expect(description).to_have_text(describe_step(views_server, 10, generation=1))
    cells_page.get_by_test_id("agent-a").select_option("7")
    expect(heading).to_have_text("Life, agent 7, generation 1")
    expect(description).to_have_text(describe_step(views_server, 10, generation=1, agent=7))
    cells_page.get_by_role("slider", name="Generation").press("End")
    expect(description).to_have_text(describe_step(views_server, 10, generation=3, agent=7))
    expect(cells_page).to_have_url(
        re.compile("generation=3&step=10&agent=7|generation=3&.*agent=7.*step=10")
    )
    cells_page.reload()
    expect(heading).to_have_text("Life, agent 7, generation 3")
    expect(description).to_have_text(describe_step(views_server, 10, generation=3, agent=7))
    cells_page.go_back()
    expect(heading).to_have_text("Life, agent 7, generation 1")


def test_a_user_selects_alleles_or_a_view_of_a_model(cells_page: Page) -> None:
    cells_page.get_by_test_id("condition-a").select_option("climbers")
    expect(cells_page.get_by_test_id("alleles-heading")).to_have_text(
        "Alleles by locus, generation 2"
    )
    expect(cells_page.get_by_test_id("agent-a")).to_be_hidden()
    cells_page.get_by_test_id("view-a").select_option("climb")
    expect(cells_page.get_by_test_id("view-heading")).to_contain_text("Climb, agent ")
    expect(cells_page.get_by_test_id("path").locator(".chart-key")).to_have_text(
        [re.compile("^agent "), "average of all", "best of all"]
    )
    expect(cells_page).to_have_url(re.compile("look=climb"))
    cells_page.reload()
    expect(cells_page.get_by_test_id("view-heading")).to_contain_text("Climb, agent ")
    cells_page.get_by_test_id("condition-a").select_option("cells")
    expect(cells_page.get_by_test_id("view-heading")).to_contain_text("Life, agent ")
    expect(cells_page.get_by_test_id("view-a")).to_be_hidden()


@pytest.mark.nightly
def test_a_path_without_steps_is_shown_as_text(cells_page: Page) -> None:
    cells_page.get_by_test_id("condition-a").select_option("climbers")
    cells_page.get_by_test_id("view-a").select_option("climb")
    path = cells_page.get_by_test_id("path")
    expect(path.locator(".uplot")).to_be_visible()
    cells_page.get_by_test_id("condition-a").select_option("still")
    expect(path).to_contain_text(
        "These lifetimes have no trial, so all values stay as they are at birth:"
        " fitness of the string"
    )
    names = ("agent", "average of all", "best of all")
    expect(path.locator("li")).to_have_text([re.compile(rf"^{name}.*: 0\.\d+$") for name in names])
    expect(path.locator(".uplot")).to_have_count(0)


def test_a_matrix_is_a_table_of_its_generation(cells_page: Page) -> None:
    cells_page.get_by_test_id("condition-a").select_option("hawks")
    table = cells_page.get_by_test_id("matrix")
    expect(cells_page.get_by_test_id("view-heading")).to_have_text("Payoffs, generation 2")
    expect(table.locator("thead th")).to_have_text(["hawk", "dove"])
    expect(table.locator("tbody tr")).to_have_text(
        [re.compile(r"^hawk \(\d+%\)04$"), re.compile(r"^dove \(\d+%\)12$")]
    )
    cells_page.get_by_test_id("about").click()
    cells_page.get_by_test_id("guide-details").locator("summary").click()
    expect(cells_page.get_by_test_id("guide")).to_contain_text(
        "The payoff of each strategy against each strategy."
    )


@pytest.mark.parametrize(
    ("query", "message"),
    [
        (f"{CELLS}&look=live", "cells has no view live. Available: life."),
        (f"{CELLS}&agent=20", "cells has no agent 20: its agents are 0 to 19."),
    ],
)
def test_an_unknown_view_shows_a_message_and_another_view(
    page: Page, views_server: LabServer, query: str, message: str
) -> None:
    page.goto(f"{views_server.entry}#/world?{query}")
    expect(page.get_by_test_id("message-error")).to_contain_text(message)
    expect(page.get_by_test_id("grid-description")).to_contain_text("environment 1 of 6")


def test_the_views_have_no_barriers(themed_page: Page, views_server: LabServer) -> None:
    for query in (f"{CELLS}&step=9&guide=open", f"{PATH}&look=climb", MATRIX):
        themed_page.goto(f"{views_server.entry}#/world?{query}")
        expect(themed_page.locator("[data-ready]")).to_have_count(1)
        expect(themed_page.get_by_test_id("view-heading")).to_contain_text("generation 2")
        assert find_violations(themed_page) == []


@every_window
def test_views_fit_in_every_window(
    browser: Browser, views_server: LabServer, width: int, height: int, dots: int
) -> None:
    with open_window(browser, width, height, dots, views_server) as page:
        for query in (f"{CELLS}&step=9", f"{PATH}&look=climb", MATRIX):
            page.goto(f"/#/world?{query}")
            expect(page.get_by_test_id("view-heading")).to_contain_text("generation 2")
            check_controls(page.evaluate(MEASURE, "/world/world_view.js"))
            # The selected option is legible.
            menus = "[data-testid=condition-a]:visible, [data-testid=agent-a]:visible"
            for menu in page.locator(menus).all():
                assert menu.evaluate("menu => menu.clientWidth") > 80
        page.goto(f"/#/world?{CELLS}&step=9")
        assert page.get_by_test_id("grid").evaluate("grid => grid.clientWidth") >= 236
