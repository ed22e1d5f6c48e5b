"""Counts and conclusions of the gallery, from artificial estimates."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from baldwinlab.analysis.estimands import QUESTIONS
from baldwinlab.analysis.estimands.questions import IMPOSSIBLE, LOG_RATIO, Estimate
from baldwinlab.analysis.gallery.decisions import Decision, SystemName, decide
from baldwinlab.analysis.gallery.summary import (
    TITLES,
    conclude,
    format_effect,
    summarize_questions,
    tabulate_measurements,
)
from tests.analysis.gallery.artificial_estimates import make_estimate

UP = 1 + np.arange(12) / 100
DOWN = -UP
NONE = np.tile([-0.001, 0.001], 6)


def make_table(**papers: list[Estimate]) -> list[Decision]:
    """Decide a table. Each estimate of a paper belongs to a system of its own."""
    return decide(
        {
            SystemName(paper, f"learner-{number}"): [entry]
            for paper, entries in papers.items()
            for number, entry in enumerate(entries)
        }
    )


def test_papers_whose_systems_disagree_are_mixed() -> None:
    (summary,) = summarize_questions(
        make_table(
            a=[make_estimate(UP), make_estimate(UP)],
            b=[make_estimate(UP), make_estimate(DOWN)],
            c=[make_estimate(NONE), make_estimate(measurability=IMPOSSIBLE)],
        )
    )
    assert summary.systems == {"yes": 3, "opposite": 1, "equivalent": 1}
    assert summary.papers == {"yes": 1, "mixed": 1, "equivalent": 1}


def test_a_paper_with_many_systems_has_the_weight_of_one_paper() -> None:
    table = make_table(a=[make_estimate(UP)] * 9, b=[make_estimate(DOWN)], c=[make_estimate(NONE)])
    (summary,) = summarize_questions(table)
    assert summary.mean is not None and summary.mean.papers == 3
    assert summary.mean.mean == pytest.approx(0, abs=0.01)
    # Two papers have no mean effect.
    (summary,) = summarize_questions(make_table(a=[make_estimate(UP)], b=[make_estimate(UP)]))
    assert summary.mean is None


def test_at_most_six_sentences_follow_from_the_table() -> None:
    papers = {
        paper: [make_estimate(UP, question=question) for question in QUESTIONS] for paper in "abc"
    }
    sentences = list(conclude(make_table(**papers)))
    assert len(sentences) == 6
    assert sentences[0].endswith("15 questions: measured, 15.")
    assert all(
        "in 3 of 3 measured systems and in 3 of 3 papers; mean effect" in sentence
        for sentence in sentences[1:]
    )
    assert tuple(TITLES) == QUESTIONS


def test_a_logarithm_is_printed_as_the_percentage_that_is_gone_with_its_terms() -> None:
    terms = {name: xr.DataArray(UP * factor) for name, factor in (("learner", 2), ("control", 1))}
    estimate = replace(make_estimate(UP, unit=LOG_RATIO, bound=0.05), terms=terms)
    table = make_table(a=[estimate], b=[estimate], c=[estimate])
    assert "mean effect +65 % (95 % interval" in list(conclude(table))[1]
    (summary,) = summarize_questions(table)
    _, ((_, effect, bound, *_), *_) = tabulate_measurements(summary).groups[0]
    assert str(effect) == "+65 % <small>[+64 %, +66 %]; learner +88 %; control +65 %</small>"
    assert bound == "±5 %"
    row = table[0].row()
    assert (row["learner"], row["control"], row["neutral"]) == pytest.approx((2.11, 1.055, None))


@pytest.mark.parametrize(
    ("effect", "text"),
    [(0.0312, "+0.031"), (-0.5, "−0.5"), (-1834.6, "−1,835"), (0.0, "+0"), (np.nan, "–")],
)
def test_an_effect_has_a_sign_and_two_digits(effect: float, text: str) -> None:
    assert format_effect(effect) == text


def test_a_logarithm_is_printed_as_a_percentage_or_as_a_factor_above_two() -> None:
    texts = {0.5: "+50 %", 1.5: "−50 %", 2.1: "×2.1", 4321: "×4,321"}
    for ratio, text in texts.items():
        assert format_effect(-np.log(ratio), LOG_RATIO) == text
