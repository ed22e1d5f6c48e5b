"""The script that writes the answers of the gallery into the pages of papers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from baldwinlab.analysis.estimands import QUESTIONS, Estimate
from baldwinlab.analysis.estimands.questions import IMPOSSIBLE
from baldwinlab.analysis.gallery.decisions import Decision, SystemName, decide
from scripts.paper_pages import render_answers
from tests.analysis.gallery.artificial_estimates import make_estimate

UP = 1 + np.arange(12) / 100


def decide_systems(**values: np.ndarray) -> list[Decision]:
    """Decide systems that answer the question on assimilation, and no other question."""
    others = [
        Estimate(IMPOSSIBLE, "Nothing is learned.", question=question)
        for question in QUESTIONS
        if question != "assimilation"
    ]
    return decide(
        {
            SystemName("paper", name): [
                *others,
                replace(make_estimate(numbers), trait="number of bits", unit="log ratio"),
            ]
            for name, numbers in values.items()
        }
    )


def test_a_page_has_a_row_per_condition_and_a_reason_per_question_without_an_answer() -> None:
    results = render_answers(decide_systems(rises=UP, ties=np.zeros(12)), 7)
    assert "(seed 7, 12 runs)." in results
    assert "| condition | `assimilation` |" in results
    # The values are logarithms: the limits are the third values from both ends, 1.02 and 1.09.
    assert "| `rises` | +65 % [+64 %, +66 %], yes |" in results
    assert "| `ties` | equal in every run |" in results
    assert "- `savings` is impossible: Nothing is learned." in results
    assert "- Trait of `assimilation`: number of bits." in results


def test_a_page_without_measured_answers_has_no_table() -> None:
    results = render_answers(decide_systems(ties=np.zeros(12)), 0)
    assert "| condition" not in results
    assert "- `assimilation` is equal in every run" in results
