"""The script that writes the results of the page of the gallery."""

from __future__ import annotations

import numpy as np

from baldwinlab.analysis.gallery.decisions import SystemName, decide
from scripts.gallery_page import PAGE, render_results, replace_results
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
    assert replaced.startswith(page[: page.index("## Results")]) and "New results." in replaced
    assert replaced.endswith(page[page.index("![Effects of learning") :])
    assert replace_results(replaced, "New results.") == replaced
