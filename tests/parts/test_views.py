"""Test the arrays of views, and the messages about arrays that do not fit together."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from baldwinlab.api.checks.declarations import check_views
from baldwinlab.api.checks.findings import FailsError
from baldwinlab.api.checks.fixture import group_parts
from baldwinlab.models.nk_climbers import NKClimbers
from baldwinlab.parts import GridView, MatrixView, PathView, View
from baldwinlab.parts.views import ViewData, arrays_of

STEPS = 4


def make_grid_view(**changes: Any) -> GridView:
    cells = np.zeros((STEPS, 2, 3), int)
    cells[:, 1, 2] = 2
    view = GridView(
        {"wall": "gray", "food": "green"},
        cells,
        np.zeros((STEPS, 2), int),
        np.zeros(STEPS, int),
        np.zeros(STEPS),
        np.zeros(STEPS, int),
        "trial",
    )
    return view._replace(**changes)


def test_arrays_of_a_view_have_the_types_that_a_web_page_reads() -> None:
    matrix = arrays_of(MatrixView(["a", "b"], ["c"], np.array([[1.5], [np.nan]]), "points"))
    assert matrix["values"].dtype == np.float32
    assert matrix["values"].shape == (2, 1)
    assert np.isnan(matrix["values"][1, 0])
    path = arrays_of(PathView({"a": np.arange(3), "b": np.ones(3)}, "trial", "fitness"))
    assert path["lines"].tolist() == [[0, 1, 2], [1, 1, 1]]
    grid = arrays_of(make_grid_view())
    assert {name: (array.dtype.name, array.shape) for name, array in grid.items()} == {
        "cells": ("uint8", (STEPS, 2, 3)),
        "position": ("int16", (STEPS, 2)),
        "heading": ("int8", (STEPS,)),
        "gained": ("float32", (STEPS,)),
        "visit": ("uint32", (STEPS,)),
    }


def _random_view(model: Any, key: Any, genomes: Any, agent: int) -> PathView:
    return PathView({"a": np.random.default_rng().random(3)}, "step", "chance")


def _view_that_changes_genomes(model: Any, key: Any, genomes: Any, agent: int) -> PathView:
    genomes[agent] = 7
    return PathView({"a": np.zeros(3)}, "step", "nothing")


@pytest.mark.parametrize(
    ("function", "sentence"),
    [
        (_random_view, "the view 'look' of agent 0 differs when it is repeated"),
        (_view_that_changes_genomes, "the view 'look' changes the genomes that it is given"),
        (
            lambda *given: PathView({}, "", ""),
            "the view 'look' of agent 0: a path view must have at least one line, "
            "and a line at least one number",
        ),
    ],
)
def test_a_check_reports_an_invalid_view(
    monkeypatch: pytest.MonkeyPatch, function: Any, sentence: str
) -> None:
    (group,) = group_parts([NKClimbers])
    assert check_views(group) == "climb"
    monkeypatch.setattr(NKClimbers, "views", {"look": View("", function)})
    with pytest.raises(FailsError, match=f"^{re.escape(sentence)}$"):
        check_views(group)


@pytest.mark.parametrize(
    ("view", "sentence"),
    [
        (
            MatrixView(["a"], ["b", "c"], np.zeros((2, 1)), ""),
            r"values is \[2, 1\] and must be \[1, 2\]",
        ),
        (PathView({"a": np.zeros(3), "b": np.zeros(2)}, "", ""), r"b is \[2\] and must be \[3\]"),
        (PathView({}, "", ""), "a path view must have at least one line"),
        (make_grid_view(heading=np.zeros(3)), r"heading is \[3\] and must be \[4\]"),
        (
            make_grid_view(position=np.zeros((STEPS, 3))),
            r"position is \[4, 3\] and must be \[4, 2\]",
        ),
        (make_grid_view(cell_colors={"food": "green"}), "whole numbers from 0 to 1, the number of"),
        (make_grid_view(cells=np.zeros((2, 3))), "cells must be an array"),
        (make_grid_view(cells=np.zeros((0, 2, 3), int)), "with at least one step"),
        (make_grid_view(cells=np.full((STEPS, 2, 3), -1)), "whole numbers from 0 to 2"),
        (make_grid_view(cells=np.full((STEPS, 2, 3), 0.5)), "whole numbers from 0 to 2"),
        (make_grid_view(cells=np.full((STEPS, 2, 3), np.nan)), "whole numbers from 0 to 2"),
    ],
)
def test_arrays_that_do_not_fit_together_are_refused_in_a_sentence(
    view: ViewData, sentence: str
) -> None:
    with pytest.raises(ValueError, match=sentence):
        arrays_of(view)
