"""The report of a study of many conditions, which asks questions of its own: what is read first, and what is folded."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from playwright.sync_api import Browser

from baldwinlab import papers
from baldwinlab.analysis.claims import evaluate
from baldwinlab.analysis.report import InShort, draw_report, write_report
from baldwinlab.analysis.report.content import named
from baldwinlab.experiment.factors import Factors
from tests.analysis.report.browsing import complaints_and_width
from tests.analysis.statistics.studies import RUNS, study
from tests.axe import barriers

PAPER = papers.load("worlds-and-minds")
LEARNERS = ("evo", "evo+self-taught", "evo+crbp", "evo+abcd")
IN_SHORT = InShort(
    ["Some ways of learning find food."], "<table><tr><td>a table of them</td></tr></table>"
)


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("many")
    eaten = {
        f"{name}/{place}": range(10 * number, 10 * number + RUNS)
        for place in "ABCD"
        for number, name in enumerate(LEARNERS)
    }
    data = study(eaten, generations=3, agents=2)
    drawn = draw_report(folder, data, evaluate(data, 10, PAPER), [], {}, paper=PAPER)
    return write_report(folder, drawn, folder / "report.html", in_short=IN_SHORT)


def test_questions_of_its_own_are_held_against_no_paper(page: Path) -> None:
    text = re.sub(r'src="[^"]*"', "", page.read_text("utf-8"))
    assert "Of 76 claims, " in text and "Of the paper" not in text
    assert ">The paper</th>" not in text and 'data-label="paper"' not in text
    assert 'id="differences"' not in text
    assert "There are 8 runs, where the paper has 20" in text, "which stands with what was run"


def test_the_figure_that_sums_up_stands_in_short_between_what_is_said_and_the_table(
    page: Path,
) -> None:
    head, *others = page.read_text("utf-8").split('<h2 id="what-was-run"')
    order = [
        head.index(part)
        for part in (IN_SHORT.sentences[0], 'id="figure-overview"', "a table of them")
    ]
    assert order == sorted(order)
    assert 'id="figure-overview"' not in "".join(others)


def test_long_tables_are_folded(page: Path) -> None:
    text = page.read_text("utf-8")
    for title in ("Each of the claims", "Each of the claims, in numbers", "All conditions"):
        assert f"<details><summary>{title}</summary>" in text
    assert text.count("<details") == text.count("</details>")


def test_learners_and_maps_stand_for_many_conditions(page: Path) -> None:
    assert "<dd>16: each of 4 learners on each of 4 maps</dd>" in page.read_text("utf-8")
    few = {f"evo/{place}": Factors("evo", place) for place in "AB"}
    assert named(few) == [("conditions", "evo/A, evo/B")]
    uneven = {f"{number}/A": Factors(str(number), "A") for number in range(20)} | {
        "0/B": Factors("0", "B")
    }
    assert named(uneven) == [("conditions", ", ".join(uneven))]


@pytest.mark.parametrize(("width", "height"), [(1280, 900), (390, 844)], ids=["desk", "phone"])
def test_a_browser_shows_it_without_complaint_and_without_scrolling_sideways(
    browser: Browser, page: Path, width: int, height: int
) -> None:
    assert complaints_and_width(browser, page, width, height) == ([], width)


def test_axe_finds_no_barrier_in_it(browser: Browser, page: Path) -> None:
    with browser.new_context() as context:
        opened = context.new_page()
        opened.goto(page.as_uri())
        opened.evaluate("document.querySelectorAll('details').forEach(part => part.open = true)")
        assert barriers(opened) == []
