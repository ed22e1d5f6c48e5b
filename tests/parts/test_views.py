"""What a view gives: arrays in the types of a page, and a sentence where they do not fit together."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from baldwinlab.api.checks.findings import FailsError
from baldwinlab.api.checks.fixture import group_parts
from baldwinlab.api.checks.views import check_views
from baldwinlab.models.nk_climbers import NKClimbers
from baldwinlab.parts import GridView, MatrixView, PathView, View
from baldwinlab.parts.views import ViewData, arrays_of

STEPS = 4


def cells(**changes: Any) -> GridView:
    ground = np.zeros((STEPS, 2, 3), int)
    ground[:, 1, 2] = 2
    each = np.zeros(STEPS)
    whole = GridView(
        {"wall": "gray", "food": "green"},
        ground,
        np.zeros((STEPS, 2), int),
        each.astype(int),
        each,
        each.astype(int),
        "trial",
    )
    return whole._replace(**changes)


def test_what_fits_together_comes_in_the_types_of_a_page() -> None:
    payoffs = arrays_of(MatrixView(["a", "b"], ["c"], np.array([[1.5], [np.nan]]), "points"))
    assert (
        payoffs["values"].dtype == np.float32
        and payoffs["values"].shape == (2, 1)
        and np.isnan(payoffs["values"][1, 0])
    )
    walk = arrays_of(PathView({"a": np.arange(3), "b": np.ones(3)}, "trial", "fitness"))
    assert walk["lines"].tolist() == [[0, 1, 2], [1, 1, 1]]
    found = arrays_of(cells())
    assert {name: (array.dtype.name, array.shape) for name, array in found.items()} == {
        "cells": ("uint8", (STEPS, 2, 3)),
        "position": ("int16", (STEPS, 2)),
        "heading": ("int8", (STEPS,)),
        "gained": ("float32", (STEPS,)),
        "visit": ("uint32", (STEPS,)),
    }


def _drawn(model: Any, key: Any, genomes: Any, agent: int) -> PathView:
    return PathView({"a": np.random.default_rng().random(3)}, "step", "chance")


def _changing(model: Any, key: Any, genomes: Any, agent: int) -> PathView:
    genomes[agent] = 7
    return PathView({"a": np.zeros(3)}, "step", "nothing")


@pytest.mark.parametrize(
    ("of", "sentence"),
    [
        (_drawn, "the view 'look' of agent 0 differs when it is repeated"),
        (_changing, "the view 'look' changes the genomes that it is given"),
        (
            lambda *given: PathView({}, "", ""),
            "the view 'look' of agent 0: a path view must have at least one line, and a line at least one number",
        ),
    ],
)
def test_a_check_finds_views_that_are_not_as_they_should_be(
    monkeypatch: pytest.MonkeyPatch, of: Any, sentence: str
) -> None:
    (group,) = group_parts([NKClimbers])
    assert check_views(group) == "climb"
    monkeypatch.setattr(NKClimbers, "views", {"look": View("", of)})
    with pytest.raises(FailsError, match=f"^{re.escape(sentence)}$"):
        check_views(group)


@pytest.mark.parametrize(
    ("seen", "sentence"),
    [
        (
            MatrixView(["a"], ["b", "c"], np.zeros((2, 1)), ""),
            r"values is \[2, 1\] and must be \[1, 2\]",
        ),
        (PathView({"a": np.zeros(3), "b": np.zeros(2)}, "", ""), r"b is \[2\] and must be \[3\]"),
        (PathView({}, "", ""), "a path view must have at least one line"),
        (cells(heading=np.zeros(3)), r"heading is \[3\] and must be \[4\]"),
        (cells(position=np.zeros((STEPS, 3))), r"position is \[4, 3\] and must be \[4, 2\]"),
        (cells(marks={"food": "green"}), "cells must be .* of numbers of marks"),
        (cells(cells=np.zeros((2, 3))), "cells must be"),
    ],
)
def test_what_does_not_fit_together_is_said(seen: ViewData, sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence):
        arrays_of(seen)
