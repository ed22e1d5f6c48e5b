"""Tests of the views of models for stored runs."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from baldwinlab.evolution import GenerationKey
from baldwinlab.lab.sources import life_query
from baldwinlab.models.cell_foragers import CellForagers
from baldwinlab.parts.views import arrays_of
from baldwinlab.studies.store import StudyStore
from tests.lab.client import LabServer, check_errors, get_arrays, get_error, get_json

LIFE = {"study": "views", "condition": "cells", "run": 1, "generation": 2, "view": "life"}


def test_a_view_shows_the_fittest_agent_or_the_requested_agent(
    views_server: LabServer,
) -> None:
    record = StudyStore(views_server.root / "views").read("cells", 1)
    fittest = int(record.energy.values[2].argmax())
    header, arrays = get_arrays(views_server.address, "view", **LIFE)
    expected = {"kind": "grid", "agent": fittest, "visit_label": "environment"}
    assert header.items() >= {**expected, "cell_colors": {"food": "green"}}.items()
    assert arrays["gained"].reshape(6, -1)[:, -1].mean() == pytest.approx(
        record.energy.values[2, fittest]
    )
    header, arrays = get_arrays(views_server.address, "view", **LIFE, agent=3)
    model = CellForagers(environments=6, steps_per_environment=20)
    view = model.views["life"].make_data(model, GenerationKey(5, 1, 2), record.genome.values[2], 3)
    assert header["agent"] == 3
    assert all((arrays[name] == values).all() for name, values in arrays_of(view).items())


def test_genomes_that_are_not_stored_are_recomputed(views_server: LabServer) -> None:
    _, stored = get_arrays(views_server.address, "view", **LIFE)
    _, recomputed = get_arrays(views_server.address, "view", **LIFE | {"condition": "sparse"})
    record = StudyStore(views_server.root / "views").read("sparse", 1)
    assert np.isnan(record.genome.values[2]).all()
    assert all((stored[name] == recomputed[name]).all() for name in stored)


def test_a_path_and_a_matrix_have_names(views_server: LabServer) -> None:
    header, arrays = get_arrays(
        views_server.address, "view", **LIFE | {"condition": "climbers", "view": "climb"}
    )
    assert header["names"] == [f"agent {header['agent']}", "average of all", "best of all"]
    assert header["step_label"] == "trial"
    assert arrays["lines"].shape == (3, 6)
    header, arrays = get_arrays(
        views_server.address, "view", **LIFE | {"condition": "hawks", "view": "payoffs"}
    )
    assert (header["kind"], header["agent"]) == ("matrix", None)
    assert header["columns"] == ["hawk", "dove"]
    assert arrays["values"].tolist() == [[0, 4], [1, 2]]
    assert header["description"] == "Hawks and doves. Each agent plays against all agents."


def test_the_list_of_studies_contains_the_views_of_each_condition(views_server: LabServer) -> None:
    (study,) = get_json(views_server.address, "studies")["studies"]
    views = {
        condition["name"]: [(view["name"], view["has_agent_choice"]) for view in condition["views"]]
        for condition in study["conditions"]
    }
    life = [("life", True)]
    assert views == {
        "cells": life,
        "sparse": life,
        "climbers": [("climb", True)],
        "still": [("climb", True)],
        "hawks": [("payoffs", False)],
    }


def test_an_unknown_view_is_rejected(
    views_server: LabServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    other_name = (
        "cells: the model cell-foragers has no view 'live' (did you mean 'life'?); its views are"
        " life"
    )
    rows: list[tuple[dict[str, Any], int, str]] = [
        ({"view": "live"}, 404, other_name),
        ({"agent": 20}, 404, "cells has no agent 20: its agents are 0 to 19"),
        ({"generation": 4}, 404, "…cells has no generation 4…"),
        ({"run": 7}, 404, "…has no run 7 of cells…"),
        ({"agent": "x"}, 400, "…must be a whole number…"),
        ({"view": ""}, 400, "…view is missing…"),
    ]
    check_errors(
        views_server,
        [("view", LIFE | change, status, message) for change, status, message in rows],
    )
    monkeypatch.setattr(life_query, "MAX_RESPONSE_BYTES", 1000)
    error = get_error(views_server.address, "view", 400, **LIFE, agent=4)
    assert "one response can contain" in error
