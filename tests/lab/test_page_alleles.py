"""The World tab of a model whose lives have no world: the alleles of its genomes, locus by locus, through the generations."""

from __future__ import annotations

import json
import re
from shutil import rmtree
from typing import Any
from urllib.parse import quote

import numpy as np
import numpy.typing as npt
import pytest
from playwright.sync_api import Browser, Page, expect

from baldwinlab.experiment import assign
from baldwinlab.papers.presets import load
from baldwinlab.simulation.simulate import simulate
from baldwinlab.studies.store import StudyStore
from tests.lab.client import WINDOWS, LabServer
from tests.lab.test_page_layout import LOW, MEASURE, window

RUN = "study=strings&condition=guessing&run=1"

# Of every locus, the height of each of its parts as a share of the whole bar.
HEIGHTS = """bars => bars.map(bar => [...bar.children].map(part =>
    part.getBoundingClientRect().height / bar.getBoundingClientRect().height))"""


@pytest.fixture
def opened(page: Page, strings_server: LabServer) -> Page:
    """The last but one generation."""
    page.goto(f"{strings_server.entry}#/world?{RUN}&generation=3")
    expect(page.locator("[data-ready]")).to_have_count(1)
    return page


def expected(server: LabServer, generation: int, run: int = 1) -> npt.NDArray[Any]:
    """The shares [locus, allele] of 0, ? and 1."""
    genomes = (
        StudyStore(server.root / "strings").read("guessing", run).genome.values[generation, :, 0]
    )
    return np.stack([(genomes == value).mean(axis=0) for value in (0, 0.5, 1)], axis=-1)


def require_shown(page: Page, server: LabServer, generation: int, run: int = 1) -> None:
    """The bars, and what is read aloud, are those of a generation."""
    expect(page.locator("[data-ready]")).to_have_count(1)
    expect(page.get_by_test_id("alleles-heading")).to_have_text(
        f"Alleles by locus, generation {generation}"
    )
    shares = expected(server, generation, run)
    assert np.allclose(page.locator(".allele-bar").evaluate_all(HEIGHTS), shares, atol=0.01)
    read = page.get_by_test_id("alleles-table").locator("tbody tr").all_inner_texts()
    assert [line.split("\t") for line in read] == [
        [str(locus), *(f"{100 * share:g} %" for share in of_locus)]
        for locus, of_locus in enumerate(shares)
    ]


def test_bars_and_table_are_those_of_the_genomes_whichever_way_the_generation_is_chosen(
    opened: Page, strings_server: LabServer
) -> None:
    page = opened
    require_shown(page, strings_server, 3)
    page.keyboard.press("[")
    require_shown(page, strings_server, 2)
    page.get_by_role("button", name="Next generation").click()
    require_shown(page, strings_server, 3)
    page.get_by_role("slider", name="Generation").press("Home")
    require_shown(page, strings_server, 0)
    expect(page.get_by_role("slider", name="Generation")).to_have_attribute(
        "aria-valuetext", re.compile("^generation 0, fitness:")
    )
    page.get_by_test_id("run-a").select_option("0")
    require_shown(page, strings_server, 0, run=0)


def test_generations_play_one_after_the_other_and_stop_at_the_last(
    opened: Page, strings_server: LabServer
) -> None:
    page, tour = opened, opened.get_by_test_id("tour-a")
    page.keyboard.press("g")
    expect(tour).to_have_attribute("aria-pressed", "true")
    for generation in range(5):
        expect(page.get_by_test_id("alleles-heading")).to_have_text(
            f"Alleles by locus, generation {generation}"
        )
    expect(tour).to_have_attribute("aria-pressed", "false")
    require_shown(page, strings_server, 4)


def test_the_address_holds_what_is_shown_and_leads_back_to_it(
    opened: Page, strings_server: LabServer
) -> None:
    page = opened
    page.keyboard.press("]")
    expect(page).to_have_url(re.compile(rf"#/world\?{re.escape(RUN)}&generation=4$"))
    page.reload()
    require_shown(page, strings_server, 4)
    page.go_back()
    require_shown(page, strings_server, 3)


def test_nothing_is_offered_that_only_a_world_has(opened: Page) -> None:
    for control in (
        "play",
        "on",
        "speed",
        "trails",
        "sight",
        "compare",
        "agents",
        "fit",
        "share",
        "world-a",
    ):
        expect(opened.get_by_test_id(control)).to_have_count(0)


def test_a_part_has_its_allele_s_name_and_the_pointer_is_told_of_a_locus(
    opened: Page, strings_server: LabServer
) -> None:
    expect(opened.get_by_test_id("alleles-legend")).to_have_text("from bottom to top:0?1")
    assert opened.locator(".allele-bar").first.locator("span").all_inner_texts() == ["0", "?", "1"]
    zero, unset, one = (f"{100 * share:g} %" for share in expected(strings_server, 3)[2])
    opened.locator("[data-locus='2'] .allele-bar").hover()
    expect(opened.locator(".allele-plot .tip")).to_have_text(
        f"locus 2: 0 in {zero}, ? in {unset}, 1 in {one}"
    )


def test_the_tab_says_what_one_sees(opened: Page) -> None:
    opened.get_by_test_id("about").click()
    guide = opened.get_by_test_id("guide")
    expect(guide).to_contain_text("guessing, run 1, generation 3, of the study strings")
    expect(guide).to_contain_text("Each bar is one locus of the genome")
    expect(guide).to_contain_text("Bit strings that learn by guessing undefined loci.")


def test_worlds_and_alleles_take_each_other_s_place_as_they_are_chosen(
    opened: Page, strings_server: LabServer
) -> None:
    page = opened
    page.get_by_test_id("study-a").select_option("small")
    expect(page.get_by_test_id("world-a")).to_be_visible()
    expect(page.get_by_test_id("alleles")).to_have_count(0)
    expect(page).to_have_url(re.compile("study=small&condition=evo/A"))
    page.get_by_test_id("study-a").select_option("strings")
    expect(page.get_by_test_id("world-a")).to_have_count(0)
    require_shown(page, strings_server, 2)


def test_a_point_in_the_results_leads_to_the_alleles_of_its_run(
    page: Page, strings_server: LabServer
) -> None:
    page.goto(f"{strings_server.entry}#/results?study=strings")
    page.get_by_role("link", name=re.compile("^guessing, run 1: ")).first.press("Enter")
    require_shown(page, strings_server, 4)


def test_a_live_run_shows_the_newest_alleles_or_those_of_the_generation_picked_and_leads_to_the_world_tab(
    page: Page, strings_server: LabServer
) -> None:
    changes = {
        "population.size": 40,
        "evolution.generations": 5,
        "hinton_nowlan.loci": 6,
        "hinton_nowlan.trials": 10,
    }
    page.goto(
        f"{strings_server.entry}#/live?preset=guessing&runs=2&pace=0&set={quote(json.dumps(changes), safe='')}"
    )
    page.get_by_test_id("start").click()
    heading, newest = page.get_by_test_id("alleles-heading"), page.get_by_test_id("live-newest")
    expect(heading).to_have_text("Alleles by locus, generation 4", timeout=60_000)
    expect(newest).to_have_attribute("aria-pressed", "true")
    page.get_by_test_id("live-fitness").locator(".u-over").click(position={"x": 1, "y": 50})
    expect(heading).to_have_text("Alleles by locus, generation 0")
    expect(newest).to_have_attribute("aria-pressed", "false")
    expect(page).to_have_url(re.compile("generation=0"))
    page.get_by_test_id("live-run").select_option("1")
    bars = page.locator(".allele-bar")
    expect(bars).to_have_count(6)
    genomes = simulate(
        assign(load("guessing"), [f"{name}={value}" for name, value in changes.items()]),
        seed=0,
        run=1,
    ).genome
    founders = np.stack(
        [(genomes.values[0, :, 0] == value).mean(axis=0) for value in (0, 0.5, 1)], axis=-1
    )
    expect(page.get_by_test_id("alleles-table").locator("tbody tr").first).to_have_text(
        "".join(["0", *(f"{100 * share:g} %" for share in founders[0])])
    )
    assert np.allclose(bars.evaluate_all(HEIGHTS), founders, atol=0.01)
    newest.click()
    expect(heading).to_have_text("Alleles by locus, generation 4")
    page.get_by_test_id("keep").click()
    page.get_by_test_id("keep-name").fill("watched")
    page.keyboard.press("Enter")
    page.get_by_test_id("live-open-world").click()
    expect(page).to_have_url(
        re.compile(r"#/world\?study=watched&condition=guessing&run=1&generation=4")
    )
    expect(heading).to_have_text("Alleles by locus, generation 4")
    rmtree(strings_server.root / "watched")  # other tests count the studies


@pytest.mark.parametrize(
    "asked",
    [
        "study=strings&condition=guessing&run=9",
        "study=strings&condition=x",
        "study=strings&generation=5",
    ],
)
def test_what_is_not_there_is_said_and_something_else_is_shown(
    page: Page, strings_server: LabServer, asked: str
) -> None:
    page.goto(f"{strings_server.entry}#/world?{asked}")
    expect(page.get_by_test_id("message-error")).to_contain_text(
        re.compile("has no (run 9|finished runs of x|generation 5)")
    )
    expect(page.get_by_test_id("alleles-heading")).to_have_text("Alleles by locus, generation 4")


def test_the_bars_of_a_record_that_is_damaged_go_away(
    browser: Browser, strings_server: LabServer
) -> None:
    record = StudyStore(strings_server.root / "strings").path("sparse", 0)
    sound = record.read_bytes()
    record.write_bytes(sound[:-40])
    with window(browser, *WINDOWS["desk"]) as page:  # its console tells of the refusal
        page.goto(
            f"{strings_server.entry}#/world?study=strings&condition=sparse&run=1&generation=3"
        )
        expect(page.locator(".allele-bar")).to_have_count(6)
        page.get_by_test_id("run-a").select_option("0")
        expect(page.get_by_test_id("message-error")).to_contain_text(record.name)
        expect(page.locator(".allele-bar")).to_have_count(0)
        expect(page.get_by_test_id("alleles-heading")).to_be_empty()
    record.write_bytes(sound)


@pytest.mark.parametrize(("width", "height", "dots"), [WINDOWS["desk"], WINDOWS["phone"], *LOW])
def test_bars_have_room_and_every_control_can_be_reached(
    browser: Browser, strings_server: LabServer, width: int, height: int, dots: int
) -> None:
    with window(browser, width, height, dots) as page:
        page.goto(f"{strings_server.entry}#/world?{RUN}&generation=3")
        page.get_by_test_id("close-guide").click()
        assert page.locator(".allele-bar").first.evaluate("bar => bar.clientHeight") >= 160
        found = page.evaluate(MEASURE, "/world.js")
        assert max(found["wide"]) <= 0 and found["lost"] == [] and found["controls"] > 5, found
        expect(page.get_by_test_id("alleles")).to_be_in_viewport(ratio=0.9)
