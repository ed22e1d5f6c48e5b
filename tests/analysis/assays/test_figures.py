"""The figures of the assays can be drawn of whatever is stored, to the same bytes each time."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

from baldwinlab.analysis.assays.evaluation import Assays, load_evaluations
from baldwinlab.analysis.figures.style import to_svg
from baldwinlab.analysis.typeface import TEXT_SIZE
from tests.analysis.assays.artificial_assays import constant, innate, make_all_assays

A = "evo+self-taught/A"
B = "evo+self-taught/B"

FIGURES = {
    figure.name: (assay, figure)
    for assay, evaluation in load_evaluations().items()
    for figure in evaluation.figures
}


def draw(name: str, assays: Assays, conditions: Sequence[str]) -> Figure:
    """Draw the figure of a name."""
    assay, figure = FIGURES[name]
    return figure.draw(assays[assay], conditions, "fitness")


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.nightly] * (name not in ("lives", "within-life")))
        for name in FIGURES
    ],
)
def test_a_figure_has_the_same_bytes_each_time_and_no_small_text(name: str) -> None:
    assays = make_all_assays()
    figure = draw(name, assays, [A, B])
    assert to_svg(draw(name, assays, [A, B])) == to_svg(figure)
    texts = [text for text in figure.findobj(Text) if isinstance(text, Text) and text.get_text()]
    assert texts and min(float(text.get_fontsize()) for text in texts) >= TEXT_SIZE
    assert figure.get_size_inches()[0] <= 7.2


@pytest.mark.parametrize("name", FIGURES)
def test_a_single_run_is_drawn_without_a_warning(name: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert to_svg(draw(name, make_all_assays(runs=1), [A, B]))


def test_three_conditions_have_two_rows_and_missing_kinds_of_life_are_left_out() -> None:
    bare = innate(A, off=constant(1), on=constant(2))
    stored = {
        A: bare,
        B: bare.assign_attrs(map="B"),
        "mine": bare.assign_attrs(learner="mine", map=""),
    }
    figure = draw("lives", {"innate": stored}, [A, B, "mine"])
    shown = [axes for axes in figure.axes if axes.get_visible()]
    titles = [title for axes in shown if (title := axes.get_title("left"))]
    assert titles == ["Map A, evo+self-taught", "Map B, evo+self-taught", "mine"]
    assert len(shown) == 6 and len(shown[0].get_lines()) == 2


def test_weight_changes_are_drawn_if_a_model_has_weights() -> None:
    data = innate(A, off=constant(1), on=constant(2))
    without_weights = data.assign(
        distance=data["energy"].isel(life=0, drop=True).expand_dims(layer=["genome"]) * np.nan
    )
    with_weights = without_weights.assign(distance=without_weights["distance"].fillna(1.0))
    panels = [
        len(draw("learning", {"innate": {A: data}}, [A]).axes)
        for data in (with_weights, without_weights)
    ]
    assert panels == [2, 1]


def test_a_reaction_norm_marks_the_value_of_evolution() -> None:
    figure = draw("reaction-norms", make_all_assays(), [])
    labels = [[tick.get_text() for tick in axes.get_xticklabels()] for axes in figure.axes]
    assert (
        ["10", "(50)", "100"] in labels
        and ["(A)", "B"] in labels
        and ["0.001", "(0.01)", "0.1"] in labels
    )


def test_the_share_of_first_meals_ends_at_the_share_of_agents_that_ate() -> None:
    stored = make_all_assays()
    meals = stored["within-life"][A]["first_meal"]
    meals[{"newborns": 3, "agent": 0}] = np.nan
    figure = draw("within-life", stored, [A])
    latest = figure.axes[1].get_lines()[-1]
    assert np.asarray(latest.get_ydata())[-1] == 0.75
