"""Tests of the Papers tab: the cards of papers, with links to studies and live runs."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Locator, Page, Route, expect

from baldwinlab import papers
from baldwinlab.papers.presets import factors, load
from baldwinlab.studies.creation import create_study
from baldwinlab.studies.status import write_claims
from baldwinlab.studies.store import StudyStore
from tests.axe import find_violations
from tests.lab.client import LabServer, every_window
from tests.lab.conftest import run_server
from tests.lab.test_page_first_screen import MAX_WORDS, WORDS
from tests.lab.test_page_layout import MEASURE, check_controls, open_window
from tests.lab.test_page_results import CLAIM
from tests.small_studies import make_small_study

NAME = "hinton-nowlan-1987"


@pytest.fixture(scope="module")
def papers_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LabServer]:
    """Yield a server with a study of a paper and its claims."""
    root = tmp_path_factory.mktemp("papers")
    guessing = load("guessing").replace(
        population={"size": 40}, evolution={"generations": 3}, hinton_nowlan={"loci": 6}
    )
    changes = ["hinton_nowlan.loci=6"]
    create_study(root / "needle", [guessing], 5, factors=factors(), paper=NAME, changes=changes)
    make_small_study(root / "needle", [guessing], runs=2)
    verdicts = ("holds", "holds", "does not hold", "undecided")
    write_claims(
        StudyStore(root / "needle"), [CLAIM | {"verdict": verdict} for verdict in verdicts]
    )
    with run_server(root) as server:
        yield server


@pytest.fixture
def papers_page(page: Page, papers_server: LabServer) -> Page:
    """Open the Papers tab."""
    page.goto(f"{papers_server.entry}#/papers")
    expect(page.locator(".paper-card")).to_have_count(len(papers.built_in()))
    return page


def open_card(page: Page, name: str = NAME) -> Locator:
    """Open the details of a paper, and return its card."""
    page.get_by_test_id(f"open-{name}").click()
    return page.get_by_test_id(f"paper-{name}")


@pytest.mark.nightly
def test_the_logo_opens_the_papers(page: Page, papers_server: LabServer) -> None:
    page.goto(f"{papers_server.entry}#/results?study=needle")
    page.get_by_test_id("curves").locator("canvas").first.wait_for()
    page.get_by_role("link", name="baldwinlab: papers").click()
    expect(page.get_by_test_id("tab-papers")).to_have_attribute("aria-current", "page")
    card = open_card(page)
    expect(card).to_contain_text("Geoffrey E. Hinton, Steven J. Nowlan, 1987 · Complex Systems 1")
    expect(card).to_contain_text("5 conditions, 20 runs each, 8 claims")
    expect(page).to_have_url(re.compile("#/papers$"))
    card.scroll_into_view_if_needed()
    page.wait_for_function(
        "document.querySelector('[data-paper=hinton-nowlan-1987] img').naturalWidth === 640"
    )


def test_a_card_shows_the_verdicts_of_a_study_and_opens_it(papers_page: Page) -> None:
    open_card(papers_page)
    study = papers_page.get_by_test_id("study-needle")
    expect(study).to_contain_text("changed model: hinton_nowlan.loci=6")
    expect(study.locator(".badge")).to_have_text(["2 hold", "1 is undecided", "1 does not hold"])
    study.get_by_role("link", name="Watch: needle").click()
    expect(papers_page.get_by_test_id("alleles-heading")).to_have_text(
        "Alleles by locus, generation 2"
    )
    papers_page.go_back()
    open_card(papers_page)
    papers_page.get_by_role("link", name="Results: needle").click()
    expect(papers_page.get_by_test_id("results-study")).to_have_value("needle")


def test_a_card_copies_the_command_and_opens_a_live_run(papers_page: Page) -> None:
    papers_page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    open_card(papers_page)
    papers_page.get_by_test_id(f"copy-{NAME}").click()
    expect(papers_page.get_by_test_id("message-done")).to_contain_text(
        f"baldwinlab reproduce {NAME}"
    )
    assert papers_page.evaluate("navigator.clipboard.readText()") == f"baldwinlab reproduce {NAME}"
    papers_page.get_by_role("link", name="Run live: How learning can guide evolution").click()
    expect(papers_page.get_by_test_id("preset")).to_have_value("guessing")


def test_an_address_opens_a_card_and_an_unknown_paper_shows_a_similar_paper(
    papers_page: Page,
) -> None:
    papers_page.goto(re.sub("#.*", "#/papers?paper=worlds-and-minds", papers_page.url))
    expect(papers_page.get_by_test_id("paper-worlds-and-minds")).to_be_focused()
    expect(papers_page.get_by_test_id("paper-worlds-and-minds")).to_be_in_viewport()
    expect(papers_page.get_by_text("Worlds and minds: which ways of learning")).to_be_visible()
    papers_page.goto(re.sub("#.*", "#/papers?paper=mayley-1969", papers_page.url))
    message = "there is no paper 'mayley-1969' (did you mean 'mayley-1996'?); "
    expect(papers_page.get_by_test_id("message-error")).to_contain_text(message)


def test_a_closed_card_counts_the_claims_of_the_unchanged_model(
    papers_page: Page, papers_server: LabServer
) -> None:
    expect(papers_page.get_by_test_id(f"open-{NAME}").locator(".badge")).to_have_count(0)
    guessing = load("guessing").replace(evolution={"generations": 1})
    create_study(papers_server.root / "plain", [guessing], 1, paper=NAME)
    verdicts = [CLAIM | {"verdict": verdict} for verdict in ("holds", "does not hold", "holds")]
    write_claims(StudyStore(papers_server.root / "plain"), verdicts)
    papers_page.reload()
    badge = papers_page.get_by_test_id(f"open-{NAME}").locator(".badge")
    expect(badge).to_have_text("2/3 hold")
    shutil.rmtree(papers_server.root / "plain")


def test_an_exercise_opens_a_live_run_with_its_changes(papers_page: Page) -> None:
    follow_exercises(papers_page, [NAME, "soltoggio-2008"])


@pytest.mark.nightly
def test_every_exercise_opens_a_live_run_with_its_changes(papers_page: Page) -> None:
    follow_exercises(papers_page, list(papers.built_in()))


def follow_exercises(papers_page: Page, names: list[str]) -> None:
    for name in names:
        paper = papers.built_in()[name]
        assert paper.card is not None
        papers_page.goto(re.sub("#.*", f"#/papers?paper={name}", papers_page.url))
        papers_page.get_by_test_id(f"paper-{name}").get_by_test_id("exercise").click()
        expect(papers_page.get_by_test_id("preset")).to_have_value(paper.card.exercise.preset)
        expect(papers_page.get_by_test_id("start")).to_be_enabled()
        for path, value in paper.card.exercise.changes.items():
            field = papers_page.get_by_test_id(f"field-{path}").first
            expect(field).to_have_value(f"{value:g}")


@pytest.mark.parametrize("size", [(320, 640), (844, 390), (1280, 800), (1920, 1080)], ids=str)
def test_the_first_screen_has_few_words_and_several_pictures(
    papers_page: Page, size: tuple[int, int]
) -> None:
    papers_page.set_viewport_size({"width": size[0], "height": size[1]})
    words = papers_page.evaluate(WORDS)
    assert len(words) <= MAX_WORDS, " ".join(words)
    pictures = papers_page.locator(".paper-card img")
    expect(pictures.nth(5 if size[0] >= 1280 else 0)).to_be_in_viewport()


@every_window
def test_cards_fit_in_every_window(
    browser: Browser, papers_server: LabServer, width: int, height: int, dots: int
) -> None:
    with open_window(browser, width, height, dots, papers_server) as page:
        page.goto("/#/papers")
        expect(page.locator(".paper-card")).to_have_count(len(papers.built_in()))
        check_controls(page.evaluate(MEASURE, "/world/world_view.js"))


def test_the_tab_has_no_barriers(themed_page: Page, papers_server: LabServer) -> None:
    themed_page.goto(f"{papers_server.entry}#/papers?guide=open")
    expect(themed_page.locator(".paper-card")).to_have_count(len(papers.built_in()))
    assert find_violations(themed_page) == []


@pytest.mark.nightly
def test_a_link_of_another_scheme_is_not_shown(papers_page: Page) -> None:
    """Check that the link of a third-party paper cannot run a script."""
    links = [
        "javascript:alert(1)",
        " javascript:alert(1)",
        "data:text/html,x",
        "//evil.org",
        "HTTPS://example.org/a",
    ]

    def replace_links(route: Route) -> None:
        content = route.fetch().json()
        for paper, link in zip(content["papers"], links, strict=False):
            paper["link"] = link
        route.fulfill(json=content)

    papers_page.route("**/api/papers*", replace_links)
    papers_page.reload()
    cards = papers_page.locator(".paper-card")
    for number in range(5):
        cards.nth(number).locator("summary").click()
    expect(cards.nth(4).get_by_role("link", name="the paper")).to_have_attribute(
        "href", "HTTPS://example.org/a"
    )
    for number in range(4):
        expect(cards.nth(number).get_by_role("link", name="the paper")).to_have_count(0)
