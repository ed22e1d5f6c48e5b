"""The script that writes the results of the page of the gallery."""

from __future__ import annotations

import numpy as np

from baldwinlab.analysis.gallery.decisions import Decision, SystemName, decide
from scripts.gallery_page import PAGE, compare_seeds, render_results
from scripts.pages import replace_results
from tests.analysis.gallery.artificial_estimates import make_estimate

UP = 1 + np.arange(12) / 100
VALUES = {"a": UP, "b": UP, "c": -UP, "d": np.zeros(12)}


def test_the_page_has_a_row_per_question_and_the_conclusions() -> None:
    decisions = decide(
        {SystemName(name, "learner"): [make_estimate(values)] for name, values in VALUES.items()}
    )
    results = render_results(decisions, [0, 0])
    # The classes of the four systems, then the verdicts of the three that are measured.
    assert "| `assimilation` | 3 | 1 | 0 | 0 | 0 | 2 | 1 | 0 | 0 |" in results
    assert "The studies have the seed 0, and 12 runs." in results
    assert "- Learned behavior becomes innate in 2 of 3 measured systems (1 opposite)" in results


def test_only_the_results_of_the_page_are_replaced() -> None:
    page = PAGE.read_text(encoding="utf-8")
    replaced = replace_results(page, "New results.")
    assert replaced.startswith(page[: page.index("<!-- results")]) and "New results." in replaced
    assert replaced.endswith(page[page.index("![Effects of learning") :])
    assert replace_results(replaced, "New results.") == replaced


def test_two_seeds_are_compared_by_question_and_by_claim() -> None:
    def decide_values(**values: np.ndarray) -> list[Decision]:
        systems = {
            SystemName(name, "learner"): [make_estimate(numbers)]
            for name, numbers in values.items()
        }
        return decide(systems)

    first = decide_values(a=UP, b=UP, c=-UP, e=UP, d=np.zeros(12))
    # e is missing, and d is equal in every run, so three systems are compared.
    second = decide_values(a=UP, b=-UP, c=np.tile([1.0, -1.0], 6), d=np.zeros(12))
    claims = {("p", "A1"): "holds", ("p", "A2"): "holds", ("q", "B1"): "undecided"}
    other_claims = {("p", "A1"): "holds", ("p", "A2"): "does not hold"}
    table = compare_seeds(first, claims, second, other_claims)
    assert "| `assimilation` | 3 | 1 | 33 % | 1 |" in table
    assert "| `savings` | 0 | 0 | – | 0 |" in table
    assert "| all questions | 3 | 1 | 33 % | 1 |" in table
    assert "| claims of the papers | 2 | 1 | 50 % | 1 |" in table
