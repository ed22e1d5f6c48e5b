"""The Papers tab: a card for each paper, with ways to its studies, to a live run and to its command."""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page, Route, expect

from baldwinlab import papers
from baldwinlab.papers.presets import factors, load
from baldwinlab.studies.claims_file import write_claims
from baldwinlab.studies.store import StudyStore, create
from tests.axe import find_violations
from tests.lab.client import WINDOWS, LabServer
from tests.lab.conftest import run_server
from tests.lab.test_page_layout import MEASURE, window
from tests.lab.test_page_results import CLAIM
from tests.small_studies import make_small_study

NAME = "hinton-nowlan-1987"


@pytest.fixture(scope="module")
def shelf(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LabServer]:
    """A server over a study of a paper, with a report."""
    root = tmp_path_factory.mktemp("shelf")
    guessing = load("guessing").replace(
        population={"size": 40}, evolution={"generations": 3}, hinton_nowlan={"loci": 6}
    )
    changes = ["hinton_nowlan.loci=6"]
    create(root / "needle", [guessing], 5, factors=factors(), paper=NAME, changes=changes)
    make_small_study(root / "needle", [guessing], runs=2)
    verdicts = ("holds", "holds", "does not hold", "undecided")
    write_claims(
        StudyStore(root / "needle"), [CLAIM | {"verdict": verdict} for verdict in verdicts]
    )
    with run_server(root) as server:
        yield server


@pytest.fixture
def shown(page: Page, shelf: LabServer) -> Page:
    page.goto(f"{shelf.entry}#/papers")
    expect(page.locator(".paper-card")).to_have_count(len(papers.built_in()))
    return page


def test_the_sign_of_the_house_leads_to_the_papers(page: Page, shelf: LabServer) -> None:
    page.goto(f"{shelf.entry}#/results?study=needle")
    page.get_by_test_id("curves").locator("canvas").wait_for()
    page.get_by_role("link", name="baldwinlab: papers").click()
    expect(page.get_by_test_id("tab-papers")).to_have_attribute("aria-current", "page")
    card = page.get_by_test_id(f"paper-{NAME}")
    expect(card).to_contain_text("Geoffrey E. Hinton, Steven J. Nowlan, 1987 · Complex Systems 1")
    expect(card).to_contain_text("5 conditions, 20 runs each, 8 claims")
    expect(page).to_have_url(re.compile("#/papers$"))
    card.scroll_into_view_if_needed()
    page.wait_for_function(
        "document.querySelector('[data-paper=hinton-nowlan-1987] img').naturalWidth === 640"
    )


def test_a_card_says_what_came_of_a_study_and_leads_into_it(shown: Page) -> None:
    study = shown.get_by_test_id("study-needle")
    expect(study).to_contain_text("changed model: hinton_nowlan.loci=6")
    expect(study.locator(".badge")).to_have_text(["2 hold", "1 is undecided", "1 does not hold"])
    study.get_by_role("link", name="Watch: needle").click()
    expect(shown.get_by_test_id("alleles-heading")).to_have_text("Alleles by locus, generation 2")
    shown.go_back()
    shown.get_by_role("link", name="Results: needle").click()
    expect(shown.get_by_test_id("results-study")).to_have_value("needle")


def test_a_paper_is_run_live_and_its_command_copied(shown: Page) -> None:
    shown.context.grant_permissions(["clipboard-read", "clipboard-write"])
    shown.get_by_test_id(f"copy-{NAME}").click()
    expect(shown.get_by_test_id("message-done")).to_contain_text(f"baldwinlab reproduce {NAME}")
    assert shown.evaluate("navigator.clipboard.readText()") == f"baldwinlab reproduce {NAME}"
    shown.get_by_role("link", name="Run live: How learning can guide evolution").click()
    expect(shown.get_by_test_id("preset")).to_have_value("guessing")


def test_an_address_leads_to_a_card_and_one_of_an_unknown_paper_says_which_there_are(
    shown: Page,
) -> None:
    shown.goto(re.sub("#.*", "#/papers?paper=worlds-and-minds", shown.url))
    expect(shown.get_by_test_id("paper-worlds-and-minds")).to_be_focused()
    expect(shown.get_by_test_id("paper-worlds-and-minds")).to_be_in_viewport()
    shown.goto(re.sub("#.*", "#/papers?paper=mayley-1969", shown.url))
    sentence = "there is no paper 'mayley-1969' (did you mean 'mayley-1996'?); there are le-2019, "
    expect(shown.get_by_test_id("message-error")).to_contain_text(sentence)


@pytest.mark.parametrize(("width", "height", "dots"), WINDOWS.values(), ids=WINDOWS)
def test_cards_have_room_in_every_window(
    browser: Browser, shelf: LabServer, width: int, height: int, dots: int
) -> None:
    with window(browser, width, height, dots, shelf) as page:
        page.goto("/#/papers")
        expect(page.locator(".paper-card")).to_have_count(len(papers.built_in()))
        found = page.evaluate(MEASURE, "/world.js")
        assert max(found["wide"]) <= 0 and found["lost"] == [] and found["controls"] > 5, found


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_no_barrier(browser: Browser, shelf: LabServer, scheme: str) -> None:
    with shelf.context(browser, color_scheme="dark" if scheme == "dark" else "light") as context:
        page = context.new_page()
        page.goto("/#/papers?guide=open")
        expect(page.locator(".paper-card")).to_have_count(len(papers.built_in()))
        assert find_violations(page) == []


def test_a_link_that_is_no_web_address_is_not_shown(shown: Page) -> None:
    """Whatever a server says: the page of a paper that somebody else wrote runs no script of theirs."""
    links = [
        "javascript:alert(1)",
        " javascript:alert(1)",
        "data:text/html,x",
        "//evil.org",
        "HTTPS://example.org/a",
    ]

    def answer(route: Route) -> None:
        found = route.fetch().json()
        for paper, link in zip(found["papers"], links, strict=False):
            paper["link"] = link
        route.fulfill(json=found)

    shown.route("**/api/papers*", answer)
    shown.reload()
    cards = shown.locator(".paper-card")
    expect(cards.nth(4).get_by_role("link", name="the paper")).to_have_attribute(
        "href", "HTTPS://example.org/a"
    )
    for number in range(4):
        expect(cards.nth(number).get_by_role("link", name="the paper")).to_have_count(0)
