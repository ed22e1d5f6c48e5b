"""Tests of the World tab for a model without a world: the alleles at each locus."""

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
from tests.lab.client import WINDOWS, LabServer, every_window
from tests.lab.test_page_layout import MEASURE, check_controls, open_window

RUN = "study=strings&condition=guessing&run=1"

# Return, for each locus, the heights of the parts of its bar as shares of the bar.
HEIGHTS = """bars => bars.map(bar => {
    const { height } = bar.getBoundingClientRect();
    return [...bar.children].map(part => part.getBoundingClientRect().height / height);
})"""


@pytest.fixture
def alleles_page(page: Page, strings_server: LabServer) -> Page:
    """Open the World tab at the second-last generation."""
    page.goto(f"{strings_server.entry}#/world?{RUN}&generation=3")
    expect(page.locator("[data-ready]")).to_have_count(1)
    return page


def test_the_tab_asks_one_question_and_defines_the_baldwin_effect(alleles_page: Page) -> None:
    expect(alleles_page.get_by_test_id("question")).to_have_text(
        "What changes from one generation to the next?"
    )
    expect(alleles_page.get_by_text("What is the Baldwin effect?")).to_be_visible()


def compute_frequencies(server: LabServer, generation: int, run: int = 1) -> npt.NDArray[Any]:
    """Return the frequencies [locus, allele] of 0, ? and 1 in a generation."""
    record = StudyStore(server.root / "strings").read("guessing", run)
    genomes = record.genome.values[generation, :, 0]
    return np.stack([(genomes == value).mean(axis=0) for value in (0, 0.5, 1)], axis=-1)


def check_alleles(page: Page, server: LabServer, generation: int, run: int = 1) -> None:
    """Check the bars and the table for screen readers of a generation."""
    expect(page.locator("[data-ready]")).to_have_count(1)
    expect(page.get_by_test_id("alleles-heading")).to_have_text(
        f"Alleles by locus, generation {generation}"
    )
    shares = compute_frequencies(server, generation, run)
    assert np.allclose(page.locator(".allele-bar").evaluate_all(HEIGHTS), shares, atol=0.01)
    read = page.get_by_test_id("alleles-table").locator("tbody tr").all_inner_texts()
    assert [line.split("\t") for line in read] == [
        [str(locus), *(f"{100 * share:g} %" for share in of_locus)]
        for locus, of_locus in enumerate(shares)
    ]


def test_bars_and_table_are_those_of_the_genomes_of_the_selected_generation(
    alleles_page: Page, strings_server: LabServer
) -> None:
    page = alleles_page
    check_alleles(page, strings_server, 3)
    page.keyboard.press("[")
    check_alleles(page, strings_server, 2)
    page.get_by_role("button", name="Next generation").click()
    check_alleles(page, strings_server, 3)
    page.get_by_role("slider", name="Generation").press("Home")
    check_alleles(page, strings_server, 0)
    expect(page.get_by_role("slider", name="Generation")).to_have_attribute(
        "aria-valuetext", re.compile("^generation 0, fitness:")
    )
    page.get_by_test_id("run-a").select_option("0")
    check_alleles(page, strings_server, 0, run=0)


OBSERVE_HEADINGS = """() => {
  const shown = [];
  new MutationObserver(() => {
    const heading = document.querySelector('[data-testid="alleles-heading"]')?.textContent;
    if (heading && heading !== shown.at(-1)) shown.push(heading);
    document.body.dataset.shown = shown.join("; ");
  }).observe(document.body, { childList: true, characterData: true, subtree: true });
}"""


@pytest.mark.nightly
def test_generations_play_and_stop_at_the_last_one(
    alleles_page: Page, strings_server: LabServer
) -> None:
    page = alleles_page
    play_all = page.get_by_test_id("play-all-a")
    # An observer misses no generation, however long a machine takes to answer the test.
    page.evaluate(OBSERVE_HEADINGS)
    page.keyboard.press("g")
    expected = "; ".join(f"Alleles by locus, generation {generation}" for generation in range(5))
    expect(page.locator("body")).to_have_attribute("data-shown", re.compile(f"{expected}$"))
    expect(play_all).to_have_attribute("aria-pressed", "false")
    check_alleles(page, strings_server, 4)


@pytest.mark.nightly
def test_the_address_reopens_the_shown_generation(
    alleles_page: Page, strings_server: LabServer
) -> None:
    page = alleles_page
    page.keyboard.press("]")
    expect(page).to_have_url(re.compile(rf"#/world\?{re.escape(RUN)}&generation=4$"))
    page.reload()
    check_alleles(page, strings_server, 4)
    page.go_back()
    check_alleles(page, strings_server, 3)


@pytest.mark.nightly
def test_a_part_of_a_bar_has_the_name_of_its_allele_and_a_locus_has_a_tooltip(
    alleles_page: Page, strings_server: LabServer
) -> None:
    expect(alleles_page.get_by_test_id("alleles-legend")).to_have_text("from bottom to top:0?1")
    assert alleles_page.locator(".allele-bar").first.locator("span").all_inner_texts() == [
        "0",
        "?",
        "1",
    ]
    frequencies = compute_frequencies(strings_server, 3)[2]
    zero, unset, set_to_1 = (f"{100 * share:g} %" for share in frequencies)
    alleles_page.locator("[data-locus='2'] .allele-bar").hover()
    expect(alleles_page.locator(".allele-plot .tip")).to_have_text(
        f"locus 2: 0 in {zero}, ? in {unset}, 1 in {set_to_1}"
    )


@pytest.mark.nightly
def test_the_guide_describes_the_bars(alleles_page: Page) -> None:
    alleles_page.get_by_test_id("about").click()
    guide = alleles_page.get_by_test_id("guide")
    expect(guide).to_contain_text("Each bar is one locus")
    guide.locator("summary").click()
    expect(guide).to_contain_text("guessing, run 1, generation 3, of the study strings")
    expect(guide).to_contain_text("Bit strings that learn by guessing undefined loci.")


def test_the_tab_shows_a_world_or_alleles_as_the_study_has(
    alleles_page: Page, strings_server: LabServer
) -> None:
    page = alleles_page
    page.get_by_test_id("study-a").select_option("small")
    expect(page.get_by_test_id("world-a")).to_be_visible()
    expect(page.get_by_test_id("alleles")).to_have_count(0)
    expect(page).to_have_url(re.compile("study=small&condition=evo/A"))
    page.get_by_test_id("study-a").select_option("strings")
    expect(page.get_by_test_id("world-a")).to_have_count(0)
    check_alleles(page, strings_server, 2)


def test_a_point_in_the_results_opens_the_alleles_of_its_run(
    page: Page, strings_server: LabServer
) -> None:
    page.goto(f"{strings_server.entry}#/results?study=strings")
    page.get_by_test_id("finals").locator("summary").first.click()
    page.get_by_role("link", name=re.compile("^guessing, run 1: ")).first.press("Enter")
    check_alleles(page, strings_server, 4)


@pytest.mark.nightly
def test_a_live_run_shows_the_alleles_of_the_newest_or_the_selected_generation(
    page: Page, strings_server: LabServer
) -> None:
    changes = {
        "population.size": 40,
        "evolution.generations": 5,
        "hinton_nowlan.loci": 6,
        "hinton_nowlan.trials": 10,
    }
    settings = quote(json.dumps(changes), safe="")
    page.goto(f"{strings_server.entry}#/live?preset=guessing&runs=2&pace=0&set={settings}")
    page.get_by_test_id("start").click()
    heading = page.get_by_test_id("alleles-heading")
    newest = page.get_by_test_id("live-newest")
    expect(heading).to_have_text("Alleles by locus, generation 4")
    expect(newest).to_have_attribute("aria-pressed", "true")
    page.get_by_test_id("live-fitness").locator(".u-over").click(position={"x": 1, "y": 50})
    expect(heading).to_have_text("Alleles by locus, generation 0")
    expect(newest).to_have_attribute("aria-pressed", "false")
    expect(page).to_have_url(re.compile("generation=0"))
    page.get_by_test_id("live-run").select_option("1")
    bars = page.locator(".allele-bar")
    expect(bars).to_have_count(6)
    changed = assign(load("guessing"), [f"{name}={value}" for name, value in changes.items()])
    genomes = simulate(changed, seed=0, run=1).genome
    founders = np.stack(
        [(genomes.values[0, :, 0] == value).mean(axis=0) for value in (0, 0.5, 1)], axis=-1
    )
    expect(page.get_by_test_id("alleles-table").locator("tbody tr").first).to_have_text(
        "".join(["0", *(f"{100 * share:g} %" for share in founders[0])])
    )
    assert np.allclose(bars.evaluate_all(HEIGHTS), founders, atol=0.01)
    newest.click()
    expect(heading).to_have_text("Alleles by locus, generation 4")
    page.get_by_test_id("save").click()
    page.get_by_test_id("save-name").fill("watched")
    page.keyboard.press("Enter")
    page.get_by_test_id("live-open-world").click()
    expect(page).to_have_url(
        re.compile(r"#/world\?study=watched&condition=guessing&run=1&generation=4")
    )
    expect(heading).to_have_text("Alleles by locus, generation 4")
    # Other tests expect the original studies.
    rmtree(strings_server.root / "watched")


@pytest.mark.parametrize(
    "query",
    [
        "study=strings&condition=guessing&run=9",
        "study=strings&condition=x",
        "study=strings&generation=5",
    ],
)
def test_an_unknown_generation_shows_what_exists_and_no_other_generation(
    page: Page, strings_server: LabServer, query: str
) -> None:
    page.goto(f"{strings_server.entry}#/world?{query}")
    alert = page.get_by_role("alert")
    expect(alert).to_contain_text(re.compile("has no (run 9|finished runs of x|generation 5)"))
    expect(page.get_by_test_id("alleles-heading")).to_have_count(0)
    alert.get_by_role("link").first.click()
    expect(page.get_by_test_id("alleles-heading")).to_contain_text("Alleles by locus")


@pytest.mark.nightly
def test_the_bars_disappear_if_the_record_is_damaged(
    browser: Browser, strings_server: LabServer
) -> None:
    record = StudyStore(strings_server.root / "strings").path("sparse", 0)
    content = record.read_bytes()
    record.write_bytes(content[:-40])
    # The fixture `page` would fail, because the console contains the rejected request.
    with open_window(browser, *WINDOWS["desktop"]) as page:
        page.goto(
            f"{strings_server.entry}#/world?study=strings&condition=sparse&run=1&generation=3"
        )
        expect(page.locator(".allele-bar")).to_have_count(6)
        page.get_by_test_id("run-a").select_option("0")
        expect(page.get_by_test_id("message-error")).to_contain_text(record.name)
        expect(page.locator(".allele-bar")).to_have_count(0)
        expect(page.get_by_test_id("alleles-heading")).to_be_empty()
    record.write_bytes(content)


@every_window
def test_bars_are_large_enough_and_every_control_is_reachable(
    browser: Browser, strings_server: LabServer, width: int, height: int, dots: int
) -> None:
    with open_window(browser, width, height, dots) as page:
        page.goto(f"{strings_server.entry}#/world?{RUN}&generation=3")
        assert page.locator(".allele-bar").first.evaluate("bar => bar.clientHeight") >= 160
        check_controls(page.evaluate(MEASURE, "/world/world_view.js"))
        expect(page.get_by_test_id("alleles")).to_be_in_viewport(ratio=0.9)
