"""Tests of models without a world: views of a generation, and frequencies of alleles."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.evolution import GenerationKey
from baldwinlab.lab.sources import life_query
from baldwinlab.models.cell_foragers import CellForagers
from baldwinlab.parts.views import arrays_of
from baldwinlab.simulation.simulate import simulate
from baldwinlab.studies.store import StudyStore
from tests.lab.client import (
    CLIENT,
    LabServer,
    check_errors,
    get_arrays,
    get_error,
    get_json,
    wait_until,
)

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


RUN = {"study": "strings", "condition": "guessing", "run": 1}


@pytest.mark.parametrize("condition", ["guessing", "sparse"])
def test_allele_frequencies_are_those_of_the_genomes_of_every_generation(
    strings_server: LabServer, condition: str
) -> None:
    header, arrays = get_arrays(strings_server.address, "alleles", **RUN | {"condition": condition})
    assert header["alleles"] == ["0", "?", "1"] and "to 0 or 1 at random" in header["description"]
    # Both conditions have the same seed, and `guessing` stores all genomes.
    record = StudyStore(strings_server.root / "strings").read("guessing", 1)
    genomes = record.genome.values[:, :, 0]
    assert arrays["share"].shape == (5, 6, 3)
    for allele, value in enumerate((0, 0.5, 1)):
        assert np.allclose(arrays["share"][:, :, allele], (genomes == value).mean(axis=1))


def test_the_mean_frequency_over_loci_is_the_recorded_one(strings_server: LabServer) -> None:
    _, arrays = get_arrays(strings_server.address, "alleles", **RUN)
    recorded = (
        bl.open_study(strings_server.root / "strings").data().sel(condition="guessing", run=1)
    )
    for allele, name in enumerate(("zeros", "unset", "ones")):
        assert np.allclose(arrays["share"][:, :, allele].mean(axis=1), recorded[name].mean("agent"))


def test_the_list_of_studies_contains_the_alleles_of_each_condition(
    strings_server: LabServer,
) -> None:
    small, strings = get_json(strings_server.address, "studies")["studies"]
    assert [condition["alleles"] for condition in small["conditions"]] == [[]]
    alleles = [condition["alleles"] for condition in strings["conditions"]]
    assert alleles == 2 * [["0", "?", "1"]]


@pytest.mark.parametrize("every", [1, 3])
def test_a_live_run_has_the_frequencies_of_every_simulated_generation(
    strings_server: LabServer, every: int
) -> None:
    """Compare a live run, with and without stored genomes, with a run from Python."""
    guessing = (
        StudyStore(strings_server.root / "strings")
        .experiment("guessing")
        .replace(record={"genome_every": every})
    )
    request = {"experiment": guessing.to_dict(), "runs": 2, "seed": 4}
    id = CLIENT.post(f"{strings_server.address}/api/live", json=request).json()["id"]
    wait_until(lambda: find_live_run(strings_server, id)["state"] == "done")
    assert find_live_run(strings_server, id)["alleles"] == ["0", "?", "1"]
    run = simulate(guessing.replace(record={"genome_every": 1}), seed=4, run=1)
    genomes = run.genome.values[:, :, 0]
    for generation in (4, 1, 0):
        header, arrays = get_arrays(
            strings_server.address, "alleles", live=id, run=1, generation=generation
        )
        assert header["first"] == generation
        assert arrays["share"].shape == (1, 6, 3)
        shares = np.stack(
            [(genomes[generation] == value).mean(axis=0) for value in (0, 0.5, 1)], axis=-1
        )
        assert np.allclose(arrays["share"][0], shares)
    assert "is not finished: 5 generations are" in get_error(
        strings_server.address, "alleles", 400, live=id, run=1, generation=5
    )
    assert "there is no live run 'x'" in get_error(
        strings_server.address, "alleles", 404, live="x", run=1, generation=0
    )


def find_live_run(server: LabServer, id: str) -> dict[str, Any]:
    runs: list[dict[str, Any]] = get_json(server.address, "live")["runs"]
    return next(run for run in runs if run["id"] == id)


def test_an_unknown_run_and_a_model_without_alleles_are_rejected(strings_server: LabServer) -> None:
    no_alleles = {"study": "small", "condition": "evo/A", "run": 0}
    no_world = "guessing has no world to show: its model is hinton-nowlan"
    check_errors(
        strings_server,
        [
            ("alleles", no_alleles, 404, "evo/A: the model miniworld declares no alleles"),
            ("alleles", RUN | {"condition": "x"}, 404, "…has no condition 'x'…"),
            ("alleles", RUN | {"run": 7}, 404, "…has no run 7 of guessing…"),
            ("alleles", RUN | {"run": "x"}, 400, "…must be a whole number…"),
            ("alleles", {"study": "strings"}, 400, "condition is missing from the request"),
            ("recording", RUN | {"generation": 0}, 404, no_world),
        ],
    )


def test_a_response_above_the_size_limit_is_rejected(
    strings_server: LabServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("baldwinlab.lab.sources.views.MAX_RESPONSE_BYTES", 4 * 5 * 6 * 3 - 1)
    message = get_error(strings_server.address, "alleles", 400, **RUN)
    assert message == "guessing has 5 generations of 6 loci, too many for one response"
