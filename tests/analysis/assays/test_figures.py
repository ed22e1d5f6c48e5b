"""The figures of the assays can be drawn of whatever is stored, to the same bytes each time."""

from __future__ import annotations

import warnings
from collections.abc import Callable

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

from baldwinlab.analysis.assays import figures
from baldwinlab.analysis.assays.values import Assays
from baldwinlab.analysis.figures import to_svg
from tests.analysis.assays.assayed import constant, innate, whole

A, B = "evo+self-taught/A", "evo+self-taught/B"

DRAW: dict[str, Callable[[Assays], Figure]] = {
    "lives": lambda assays: figures.innate_and_learned(assays, [A, B]),
    "learning": lambda assays: figures.what_learning_does(assays, [A, B]),
    "within-life": lambda assays: figures.within_life(assays, [A, B]),
    "modules": lambda assays: figures.modules(assays, [A, B]),
    "reaction-norms": figures.reaction_norms,
    "descent": figures.descent,
}


@pytest.mark.parametrize("name", DRAW)
def test_a_figure_has_the_same_bytes_each_time_and_no_small_text(name: str) -> None:
    figure = DRAW[name](whole())
    assert to_svg(DRAW[name](whole())) == to_svg(figure)
    texts = [text for text in figure.findobj(Text) if isinstance(text, Text) and text.get_text()]
    assert texts and min(float(text.get_fontsize()) for text in texts) >= 8
    assert figure.get_size_inches()[0] <= 7.2


@pytest.mark.parametrize("name", DRAW)
def test_a_single_run_is_drawn_without_a_warning(name: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert to_svg(DRAW[name](whole(runs=1)))


def test_three_conditions_stand_in_two_rows_and_lives_that_were_not_lived_are_left_out() -> None:
    bare = innate(A, off=constant(1), on=constant(2))
    stored = {
        A: bare,
        B: bare.assign_attrs(map="B"),
        "mine": bare.assign_attrs(learner="mine", map=""),
    }
    figure = figures.innate_and_learned({"innate": stored}, [A, B, "mine"])
    shown = [axes for axes in figure.axes if axes.get_visible()]
    titles = [title for axes in shown if (title := axes.get_title("left"))]
    assert titles == ["Map A, evo+self-taught", "Map B, evo+self-taught", "mine"]
    assert len(shown) == 6 and len(shown[0].get_lines()) == 2


def test_how_far_learning_moves_is_drawn_where_a_model_tells_it() -> None:
    told = innate(A, off=constant(1), on=constant(2))
    untold = told.assign(
        distance=told["energy"].isel(life=0, drop=True).expand_dims(layer=["genome"]) * np.nan
    )
    known = untold.assign(distance=untold["distance"].fillna(1.0))
    panels = [
        len(figures.what_learning_does({"innate": {A: data}}, [A]).axes) for data in (known, untold)
    ]
    assert panels == [2, 1]


def test_a_reaction_norm_has_the_value_that_was_evolved_in_at_its_place() -> None:
    figure = figures.reaction_norms(whole())
    labels = [[tick.get_text() for tick in axes.get_xticklabels()] for axes in figure.axes]
    assert (
        ["10", "(50)", "100"] in labels
        and ["(A)", "B"] in labels
        and ["0.001", "(0.01)", "0.1"] in labels
    )


def test_of_first_meals_the_share_ends_at_that_of_all_who_ever_ate() -> None:
    stored = whole()
    meals = stored["within-life"][A]["first_meal"]
    meals[{"newborns": 3, "agent": 0}] = np.nan
    figure = figures.within_life(stored, [A])
    latest = figure.axes[1].get_lines()[-1]
    assert np.asarray(latest.get_ydata())[-1] == 0.75
