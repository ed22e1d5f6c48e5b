"""What the views of models show of stored runs, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from baldwinlab.evolution import GenerationKey
from baldwinlab.lab import life_query
from baldwinlab.models.cell_foragers import CellForagers
from baldwinlab.parts.views import arrays_of
from baldwinlab.studies.store import StudyStore
from tests.lab.client import LabServer, get_arrays, get_error, get_json

LIFE = {"study": "looks", "condition": "cells", "run": 1, "generation": 2, "view": "life"}


def test_a_life_is_that_of_the_stored_genomes_of_the_fittest_unless_another_is_asked_for(
    looks_server: LabServer,
) -> None:
    record = StudyStore(looks_server.root / "looks").read("cells", 1)
    fittest = int(record.energy.values[2].argmax())
    header, found = get_arrays(looks_server.address, "view", **LIFE)
    assert (header["kind"], header["agent"], header["visits"], header["marks"]) == (
        "grid",
        fittest,
        "environment",
        {"food": "green"},
    )
    assert found["gained"].reshape(6, -1)[:, -1].mean() == pytest.approx(
        record.energy.values[2, fittest]
    )
    header, other = get_arrays(looks_server.address, "view", **LIFE, agent=3)
    of = CellForagers(environments=6, steps_per_environment=20)
    wanted = arrays_of(of.views["life"].of(of, GenerationKey(5, 1, 2), record.genome.values[2], 3))
    assert header["agent"] == 3 and all((other[name] == wanted[name]).all() for name in wanted)


def test_genomes_that_are_not_kept_are_bred_again(looks_server: LabServer) -> None:
    _, kept = get_arrays(looks_server.address, "view", **LIFE)
    _, bred = get_arrays(looks_server.address, "view", **LIFE | {"condition": "sparse"})
    assert np.isnan(
        StudyStore(looks_server.root / "looks").read("sparse", 1).genome.values[2]
    ).all()
    assert all((kept[name] == bred[name]).all() for name in kept)


def test_a_walk_and_a_matrix_come_with_their_names(looks_server: LabServer) -> None:
    header, found = get_arrays(
        looks_server.address, "view", **LIFE | {"condition": "climbers", "view": "climb"}
    )
    assert (
        header["names"] == [f"agent {header['agent']}", "average of all", "best of all"]
        and header["step"] == "trial"
    )
    assert found["lines"].shape == (3, 6)
    header, found = get_arrays(
        looks_server.address, "view", **LIFE | {"condition": "hawks", "view": "payoffs"}
    )
    assert (header["kind"], header["agent"], header["columns"]) == (
        "matrix",
        None,
        ["hawk", "dove"],
    )
    assert (
        found["values"].tolist() == [[0, 4], [1, 2]]
        and header["description"] == "Hawks and doves, each of whom meets everybody."
    )


def test_the_list_of_studies_says_which_views_there_are(looks_server: LabServer) -> None:
    (study,) = get_json(looks_server.address, "studies")["studies"]
    views = {
        one["name"]: [(view["name"], view["of_an_agent"]) for view in one["views"]]
        for one in study["conditions"]
    }
    life = [("life", True)]
    assert views == {
        "cells": life,
        "sparse": life,
        "climbers": [("climb", True)],
        "still": [("climb", True)],
        "hawks": [("payoffs", False)],
    }


def test_what_is_not_there_is_refused(
    looks_server: LabServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    address = looks_server.address
    assert get_error(address, "view", 404, **LIFE | {"view": "live"}) == (
        "cells: the model cell-foragers has no view 'live' (did you mean 'life'?); its views are life"
    )
    assert (
        get_error(address, "view", 404, **LIFE, agent=20)
        == "cells has no agent 20: its agents are 0 to 19"
    )
    assert "cells has no generation 4" in get_error(
        address, "view", 404, **LIFE | {"generation": 4}
    )
    assert "has no run 7 of cells" in get_error(address, "view", 404, **LIFE | {"run": 7})
    assert "must be a whole number" in get_error(address, "view", 400, **LIFE, agent="x")
    assert "view is missing" in get_error(
        address, "view", 400, **{name: value for name, value in LIFE.items() if name != "view"}
    )
    monkeypatch.setattr(life_query, "MAX_BYTES", 1000)
    assert "one response can contain" in get_error(address, "view", 400, **LIFE, agent=4)
