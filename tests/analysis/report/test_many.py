"""The report of a study with many conditions: its summary, and its folded parts."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import product
from pathlib import Path

import pytest
from playwright.sync_api import Browser

from baldwinlab import papers
from baldwinlab.analysis.claims import evaluate_claims
from baldwinlab.analysis.report.content import read_experiment_texts
from baldwinlab.analysis.report.data import ReportData
from baldwinlab.analysis.report.sections import ReportSummary
from baldwinlab.analysis.report.setup import describe_conditions, describe_variants
from baldwinlab.analysis.report.study import draw_report, write_report
from baldwinlab.experiment.conditions import Factors
from baldwinlab.experiment.toml import from_toml
from baldwinlab.papers.claims import Claim
from tests.analysis.report.browsing import errors_and_width
from tests.analysis.results.studies import RUNS, study
from tests.axe import find_violations

# Other tests draw these figures.
pytestmark = pytest.mark.usefixtures("placeholder_figures_of_module")

LEARNERS = ("evo", "evo+self-taught", "evo+crbp", "evo+abcd")
MAPS = "ABCD"
# Own questions, as in a study whose conditions are compared with the first one on each map.
CLAIMS = tuple(
    Claim.model_validate(
        {
            "id": f"W{number}",
            "title": f"{measure} of {learner} on {map_name}",
            "claim": f"The {measure} agent of {learner}/{map_name} eats more than that of evo.",
            "comparisons": [
                {
                    "a": f"{learner}/{map_name}",
                    "b": f"evo/{map_name}",
                    "measure": measure,
                    "rule": "greater",
                }
            ],
        }
    )
    for number, (learner, map_name, measure) in enumerate(
        product(LEARNERS[1:], MAPS, ("mean", "best")), 1
    )
)
PAPER = replace(papers.load("worlds-and-minds"))
vars(PAPER)["claims"] = CLAIMS
SUMMARY = ReportSummary(
    ["Some learners find food."], "<table><tr><td>a table of them</td></tr></table>"
)


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("many")
    eaten = {
        f"{name}/{map_name}": range(10 * number, 10 * number + RUNS)
        for map_name in MAPS
        for number, name in enumerate(LEARNERS)
    }
    data = study(eaten, generations=3, agents=2)
    experiments = {
        name: from_toml(text, name) for name, text in read_experiment_texts(data).items()
    }
    results = evaluate_claims(data, 10, PAPER)
    variants = describe_variants(experiments, PAPER)
    report = ReportData(folder, data, experiments, results, paper=PAPER, variants=variants)
    contents = draw_report(report)
    return write_report(folder, contents, folder / "report.html", summary=SUMMARY)


def test_the_page_of_many_conditions_is_folded(page: Path) -> None:
    text = re.sub(r'"data:[^"]*"', "", page.read_text("utf-8"))
    assert "24 own questions: " in text and "claims of the paper:" not in text
    assert ">Paper</th>" not in text and 'data-label="paper"' not in text
    assert 'id="differences"' not in text
    assert "This study has 8 runs per condition, and the paper has 60." in text
    # Long lists and all topics are folded.
    text = page.read_text("utf-8")
    assert "<details><summary>All claims</summary>" in text
    for topic in ("claims", "conditions", "comparisons", "experiments"):
        assert f'<details class="topic"><summary><h2 id="{topic}">' in text
    assert text.count("<details") == text.count("</details>")
    # Many conditions are listed by learners and maps.
    assert "<dd>16: each of 4 learners on each of 4 maps</dd>" in page.read_text("utf-8")
    few = {f"evo/{map_name}": Factors("evo", map_name) for map_name in "AB"}
    assert describe_conditions(few) == [("conditions", "evo/A, evo/B")]
    uneven = {f"{number}/A": Factors(str(number), "A") for number in range(20)} | {
        "0/B": Factors("0", "B")
    }
    assert describe_conditions(uneven) == [("conditions", ", ".join(uneven))]


def test_a_figure_is_on_the_first_screen_before_the_sentences_and_their_table(page: Path) -> None:
    head, *rest = page.read_text("utf-8").split('<h2 id="setup"')
    order = [
        head.index(part)
        for part in ('id="figure-final-fitness"', SUMMARY.sentences[0], "a table of them")
    ]
    assert order == sorted(order)
    assert 'id="figure-final-fitness"' not in "".join(rest)


@pytest.mark.parametrize(("width", "height"), [(1280, 900), (390, 844)], ids=["desk", "phone"])
def test_a_browser_shows_it_without_errors_or_horizontal_scrolling(
    browser: Browser, page: Path, width: int, height: int
) -> None:
    assert errors_and_width(browser, page, width, height) == ([], width)


def test_axe_finds_no_accessibility_error(browser: Browser, page: Path) -> None:
    with browser.new_context() as context:
        opened = context.new_page()
        opened.goto(page.as_uri())
        opened.evaluate("document.querySelectorAll('details').forEach(part => part.open = true)")
        assert find_violations(opened) == []
