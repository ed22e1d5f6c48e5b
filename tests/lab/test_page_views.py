"""The World tab of models that have views: lives in cells, walks and matrices, through agents and generations."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import Browser, Page, expect

from baldwinlab.studies.store import StudyStore
from tests.axe import find_violations
from tests.lab.client import WINDOWS, LabServer, get_arrays
from tests.lab.test_page_layout import MEASURE, window

CELLS = "study=looks&condition=cells&run=1&generation=2"
MATRIX, WALK = CELLS.replace("cells", "hawks"), CELLS.replace("cells", "climbers")


@pytest.fixture
def opened(page: Page, looks_server: LabServer) -> Page:
    """A life of the fittest agent, at its first step."""
    page.goto(f"{looks_server.entry}#/world?{CELLS}&step=0")
    expect(page.locator("[data-ready]")).to_have_count(1)
    return page


def told(server: LabServer, step: int, **asked: int) -> str:
    """What the page says of a step of a life of twenty moves in each of six environments."""
    _, found = get_arrays(
        server.address, "view", study="looks", condition="cells", run=1, view="life", **asked
    )
    row, column = found["place"][step] + 1
    looks = ("right", "down", "left", "up")[found["heading"][step]]
    where = f"environment {step // 20 + 1} of 6, step {step % 20 + 1} of 20: row {row}, column {column}, facing {looks}"
    return f"{where}; gained {found['gained'][step]:g} in this environment so far"


def test_a_life_is_gone_through_step_by_step_by_keys_and_by_its_slider(
    opened: Page, looks_server: LabServer
) -> None:
    words = opened.get_by_test_id("grid-description")
    expect(words).to_have_text(told(looks_server, 0, generation=2))
    opened.keyboard.press("ArrowRight")
    expect(words).to_have_text(told(looks_server, 1, generation=2))
    opened.keyboard.press("Shift+ArrowRight")
    expect(words).to_have_text(told(looks_server, 11, generation=2))
    slider = opened.get_by_role("slider", name="Step")
    slider.press("End")
    expect(words).to_have_text(told(looks_server, 119, generation=2))
    expect(opened).to_have_url(re.compile("step=119"))
    slider.press("Home")
    expect(words).to_have_text(told(looks_server, 0, generation=2))
    play = opened.get_by_test_id("grid-play")
    play.click()
    expect(words).not_to_have_text(told(looks_server, 0, generation=2))
    play.click()
    expect(play).to_have_attribute("aria-label", "Play")


def test_the_same_step_is_seen_in_other_generations_and_of_other_agents(
    opened: Page, looks_server: LabServer
) -> None:
    fittest = [
        int(one.argmax())
        for one in StudyStore(looks_server.root / "looks").read("cells", 1).energy.values
    ]
    opened.keyboard.press("Shift+ArrowRight")
    heading, words = (
        opened.get_by_test_id("view-heading"),
        opened.get_by_test_id("grid-description"),
    )
    expect(heading).to_have_text(f"Life, agent {fittest[2]} (fittest), generation 2")
    opened.keyboard.press("[")
    expect(heading).to_have_text(f"Life, agent {fittest[1]} (fittest), generation 1")
    expect(words).to_have_text(told(looks_server, 10, generation=1))
    opened.get_by_test_id("agent-a").select_option("7")
    expect(heading).to_have_text("Life, agent 7, generation 1")
    expect(words).to_have_text(told(looks_server, 10, generation=1, agent=7))
    opened.get_by_role("slider", name="Generation").press("End")
    expect(words).to_have_text(told(looks_server, 10, generation=3, agent=7))
    expect(opened).to_have_url(
        re.compile("generation=3&step=10&agent=7|generation=3&.*agent=7.*step=10")
    )
    opened.reload()
    expect(heading).to_have_text("Life, agent 7, generation 3")
    expect(words).to_have_text(told(looks_server, 10, generation=3, agent=7))
    opened.go_back()
    expect(heading).to_have_text("Life, agent 7, generation 1")


def test_generations_play_one_after_the_other(opened: Page) -> None:
    opened.keyboard.press("g")
    for generation in range(4):
        expect(opened.get_by_test_id("view-heading")).to_contain_text(f"generation {generation}")
    expect(opened.get_by_test_id("tour-a")).to_have_attribute("aria-pressed", "false")


def test_where_alleles_are_declared_too_the_reader_chooses_what_to_look_at(opened: Page) -> None:
    opened.get_by_test_id("condition-a").select_option("climbers")
    expect(opened.get_by_test_id("alleles-heading")).to_have_text("Alleles by locus, generation 2")
    expect(opened.get_by_test_id("agent-a")).to_be_hidden()
    opened.get_by_test_id("view-a").select_option("climb")
    expect(opened.get_by_test_id("view-heading")).to_contain_text("Climb, agent ")
    expect(opened.get_by_test_id("path").locator(".chart-key")).to_have_text(
        [re.compile("^agent "), "average of all", "best of all"]
    )
    expect(opened).to_have_url(re.compile("look=climb"))
    opened.reload()
    expect(opened.get_by_test_id("view-heading")).to_contain_text("Climb, agent ")
    opened.get_by_test_id("condition-a").select_option("cells")
    expect(opened.get_by_test_id("view-heading")).to_contain_text("Life, agent ")
    expect(opened.get_by_test_id("view-a")).to_be_hidden()


def test_where_nothing_follows_birth_a_walk_is_a_sentence_and_not_a_chart(opened: Page) -> None:
    opened.get_by_test_id("condition-a").select_option("climbers")
    opened.get_by_test_id("view-a").select_option("climb")
    walk = opened.get_by_test_id("path")
    expect(walk.locator(".uplot")).to_be_visible()
    opened.get_by_test_id("condition-a").select_option("still")
    expect(walk).to_contain_text(
        "These lifetimes have no trial, so all values stay as they are at birth: fitness of the string"
    )
    expect(walk.locator("li")).to_have_text(
        [re.compile(rf"^{who}.*: 0\.\d+$") for who in ("agent", "average of all", "best of all")]
    )
    expect(walk.locator(".uplot")).to_have_count(0)


def test_a_matrix_is_a_table_of_its_generation(opened: Page) -> None:
    opened.get_by_test_id("condition-a").select_option("hawks")
    table = opened.get_by_test_id("matrix")
    expect(opened.get_by_test_id("view-heading")).to_have_text("Payoffs, generation 2")
    expect(table.locator("thead th")).to_have_text(["hawk", "dove"])
    expect(table.locator("tbody tr")).to_have_text(
        [re.compile(r"^hawk \(\d+%\)04$"), re.compile(r"^dove \(\d+%\)12$")]
    )
    opened.get_by_test_id("about").click()
    expect(opened.get_by_test_id("guide")).to_contain_text(
        "What strategies get against each other."
    )


@pytest.mark.parametrize(
    ("asked", "sentence"),
    [
        (f"{CELLS}&look=live", "cells has no view live. Available: life."),
        (f"{CELLS}&agent=20", "cells has no agent 20: its agents are 0 to 19."),
        (
            CELLS.replace("generation=2", "generation=9"),
            "cells has no generation 9: its generations are 0 to 3.",
        ),
    ],
)
def test_what_is_not_there_is_said_and_something_else_is_shown(
    page: Page, looks_server: LabServer, asked: str, sentence: str
) -> None:
    page.goto(f"{looks_server.entry}#/world?{asked}")
    expect(page.get_by_test_id("message-error")).to_contain_text(sentence)
    expect(page.get_by_test_id("grid-description")).to_contain_text("environment 1 of 6")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_no_barrier(browser: Browser, looks_server: LabServer, scheme: str) -> None:
    with looks_server.context(
        browser, color_scheme="dark" if scheme == "dark" else "light"
    ) as context:
        page = context.new_page()
        for asked in (f"{CELLS}&step=9&guide=open", f"{WALK}&look=climb", MATRIX):
            page.goto(f"/#/world?{asked}")
            expect(page.locator("[data-ready]")).to_have_count(1)
            expect(page.get_by_test_id("view-heading")).to_contain_text("generation 2")
            assert find_violations(page) == []


@pytest.mark.parametrize(("width", "height", "dots"), WINDOWS.values(), ids=WINDOWS)
def test_views_have_room_in_every_window(
    browser: Browser, looks_server: LabServer, width: int, height: int, dots: int
) -> None:
    with window(browser, width, height, dots, looks_server) as page:
        for asked in (f"{CELLS}&step=9", f"{WALK}&look=climb", MATRIX):
            page.goto(f"/#/world?{asked}")
            if page.get_by_test_id("close-guide").is_visible():
                page.get_by_test_id("close-guide").click()
            expect(page.get_by_test_id("view-heading")).to_contain_text("generation 2")
            found = page.evaluate(MEASURE, "/world.js")
            assert max(found["wide"]) <= 0 and found["lost"] == [] and found["controls"] > 5, found
            for chooser in page.locator(
                "[data-testid=condition-a]:visible, [data-testid=agent-a]:visible"
            ).all():
                assert chooser.evaluate("chooser => chooser.clientWidth") > 80, (
                    "its choice can be read"
                )
        page.goto(f"/#/world?{CELLS}&step=9")
        assert page.get_by_test_id("grid").evaluate("grid => grid.clientWidth") >= 236
