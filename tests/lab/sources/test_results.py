"""Tests of the requests of the Results tab: the curves of runs, and reaction norms."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import numpy as np
import pytest

from baldwinlab.analysis.statistics import fitness
from baldwinlab.api.publish import lab_results
from baldwinlab.studies.assays.reaction import UNCHANGED_SETTING
from baldwinlab.studies.assays.results import encode_assay
from baldwinlab.studies.open import open_runs
from tests.analysis.assays.artificial_assays import assign_to_study, reaction
from tests.lab.client import LabServer, get_error, get_json
from tests.lab.conftest import run_server
from tests.small_studies import make_small_study, shorten_preset

CONDITION = {"study": "small", "condition": "evo+self-taught/A"}


@pytest.mark.parametrize("measure", ["best", "mean", "share"])
def test_the_curves_of_runs_are_the_values_of_the_measure(
    lab_server: LabServer, measure: str
) -> None:
    curves = get_json(lab_server.address, "results/runs", **CONDITION, measure=measure)
    values = fitness.MEASURES[measure](open_runs(lab_server.root / "small")).sel(
        condition=CONDITION["condition"]
    )
    assert list(curves) == ["0", "1"]
    for run, curve in curves.items():
        assert np.array_equal(curve, values.sel(run=int(run)))


def test_curves_of_too_many_runs_are_rejected(
    lab_server: LabServer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lab_results, "MAX_CURVE_VALUES", 5)
    shutil.copytree(lab_server.root / "small", tmp_path / "small")
    query = {"study": "small", "condition": "evo/A", "measure": "best"}
    with run_server(tmp_path) as server:
        message = get_error(server.address, "results/runs", 400, **query)
    assert message.startswith(
        "evo/A has 2 runs of 3 generations. Curves of single runs are limited to 5 values"
    )


FOOD = {"x": [400.0, 560.0], "y": [80.0, 240.0]}


def test_reaction_norms_are_the_medians_of_the_assay_with_the_evolved_value(
    tmp_path: Path,
) -> None:
    study = make_small_study(tmp_path / "it", [shorten_preset("evo/A")], runs=6)
    with run_server(tmp_path) as server:
        empty = {"unit": "", "panels": []}
        assert get_json(server.address, "results/reaction", study="it") == empty
        folder = tmp_path / "it" / "assays" / "reaction" / "evo"
        folder.mkdir(parents=True)
        assay = assign_to_study(reaction("evo/A", 60), study, "evo/A")
        (folder / "A.nc").write_bytes(encode_assay(assay))
        response = get_json(server.address, "results/reaction", study="it")
        assert response["unit"] == "items eaten"
        panels = {panel["field"]: panel for panel in response["panels"]}
        count = panels["world.food.0.count"]
        expected = {"map": "your map", "values": ["10", "50", "100"], "evolved": ["50"]}
        assert expected.items() <= count.items()
        food = assay["energy"].mean("agent")
        settings = [
            (assay["field"] == "world.food.0.count") & (assay["value"] == "10"),
            assay["field"] == UNCHANGED_SETTING,
        ]
        medians = [float(food.where(setting, drop=True).median()) for setting in settings]
        assert count["norms"]["evo/A"]["median"][:2] == pytest.approx(medians)
        assert count["norms"]["evo/A"]["low"][0] < medians[0] < count["norms"]["evo/A"]["high"][0]
        (folder / "A.nc").write_bytes(b"torn")
        assert "A.nc is damaged" in get_error(server.address, "results/reaction", 400, study="it")


def test_reaction_norms_of_conditions_with_other_evolved_values_have_gaps(tmp_path: Path) -> None:
    counts = {"evo/A": 20, "evo+self-taught/A": 50}
    experiments = [
        shorten_preset(name).replace(world={"food": [FOOD | {"count": count}]})
        for name, count in counts.items()
    ]
    study = make_small_study(tmp_path / "it", experiments, runs=2)
    for name in counts:
        path = tmp_path / "it" / "assays" / "reaction" / f"{name}.nc"
        path.parent.mkdir(parents=True)
        assay = assign_to_study(reaction(name, 60, runs=2), study, name)
        path.write_bytes(encode_assay(assay))
    # Different numbers of items are different maps, which have separate panels.
    study.factors = {
        name: factors._replace(map="A", world="") for name, factors in study.factors.items()
    }
    panels = lab_results.read_reaction_norms(study)["panels"]
    panel = next(panel for panel in panels if panel["field"] == "world.food.0.count")
    assert panel["values"] == ("10", "20", "50", "100")
    is_measured = {
        name: [median is not None for median in norm["median"]]
        for name, norm in panel["norms"].items()
    }
    assert is_measured == {
        "evo/A": [True, True, False, True],
        "evo+self-taught/A": [True, False, True, True],
    }


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="the platform has no named pipes")
def test_a_pipe_and_a_link_out_of_the_folder_are_not_read(
    lab_server: LabServer, tmp_path: Path
) -> None:
    folder = tmp_path / "root" / "it" / "assays" / "reaction"
    shutil.copytree(lab_server.root / "small", tmp_path / "root" / "it")
    folder.mkdir(parents=True)
    os.mkfifo(folder / "evo.nc")
    with run_server(tmp_path / "root") as server:
        assert "evo.nc cannot be read: it is not a regular file" in get_error(
            server.address, "results/reaction", 400, study="it"
        )
        (folder / "evo.nc").unlink()
        (tmp_path / "other.nc").write_bytes(b"")
        (folder / "evo.nc").symlink_to(tmp_path / "other.nc")
        assert "is outside" in get_error(server.address, "results/reaction", 400, study="it")
