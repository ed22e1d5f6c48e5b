"""Tests of the freezer of a lab: genome files, founders of live runs, and competitions."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.api.freezer import read_genome_file
from baldwinlab.lab.sources.freezer import MAX_FILE_BYTES
from tests.lab.client import CLIENT, LabServer, get_json
from tests.lab.conftest import run_server
from tests.small_studies import make_small_study, shorten_preset

LIFE = {"study": "small", "condition": "evo+self-taught/A", "run": 1, "generation": 2}


def post(server: LabServer, path: str, **body: Any) -> httpx.Response:
    return CLIENT.post(f"{server.address}/api/{path}", json=body)


def save(server: LabServer, name: str, **body: Any) -> Path:
    """Save agents, and return the path of the file."""
    response = post(server, "freezer", name=name, **({"life": LIFE} | body))
    assert response.status_code == 201, response.text
    stored_name: str = response.json()["name"]
    return server.root / stored_name


def test_a_population_of_the_lab_is_the_file_of_the_command_line(
    freezer: LabServer, tmp_path: Path
) -> None:
    reference = f"{freezer.root}/small:evo+self-taught/A@2[1]"
    for agent in (None, 4):
        path = save(freezer, f"agents-{agent}", agent=agent)
        expected = bl.freeze(reference, agent, out=tmp_path / f"{agent}.nc")
        assert path.read_bytes() == expected.path.read_bytes()
    assert bl.replay(genome=path, set={"lifetime.steps": 20}).sizes["agent"] == 1


def test_the_lab_lists_the_files_of_the_command_line(freezer: LabServer) -> None:
    bl.freeze(f"{freezer.root}/small:evo/A@1[0]", out=freezer.root / "from-terminal.nc")
    # A trace has the same ending.
    trace = freezer.root / "trace.nc"
    bl.replay(shorten_preset("evo/A"), run=0, generation=0).to_netcdf(trace, engine="scipy")
    files = {file["name"]: file for file in get_json(freezer.address, "freezer")["files"]}
    assert "trace.nc" not in files
    file = files["from-terminal.nc"]
    assert (file["condition"], file["generation"], file["runs"]) == ("evo/A", 1, [0])
    assert file["n_agents"] == 20
    assert {"evo/A", "evo/B"} <= set(file["conditions"])
    assert "evo+self-taught/A" not in file["conditions"]


def test_a_stored_population_starts_a_live_run(freezer: LabServer) -> None:
    path = save(freezer, "founders")
    tree = shorten_preset("evo+self-taught/B").to_dict()
    tree["evolution"]["founders"] = [{"path": str(path)}]
    id = post(freezer, "live", experiment=tree).json()["id"]
    with freezer.websocket(f"/api/live/{id}") as page:
        while '"done"' not in page.recv():
            pass
    life = {"live": id, "run": 0, "generation": 0}
    moved = save(freezer, "moved", life=life)
    assert np.array_equal(
        read_genome_file(moved).genome,
        read_genome_file(path).genome,
    )


@pytest.mark.parametrize("path", ["/etc/hostname", "OUTSIDE"])
def test_founders_outside_the_folder_start_no_run(
    freezer: LabServer, tmp_path: Path, path: str
) -> None:
    outside = tmp_path / "outside.nc"
    bl.freeze(f"{freezer.root}/small:evo/A@1[0]", out=outside)
    tree = shorten_preset("evo/A").to_dict()
    tree["evolution"]["founders"] = [{"path": path.replace("OUTSIDE", str(outside))}]
    for route in ("live", "validate"):
        response = post(freezer, route, experiment=tree, runs=1, seed=0)
        assert "is outside" in response.text
    assert response.json()["errors"][0]["path"] == "evolution.founders.0"


def test_founders_that_do_not_fit_are_an_error_of_their_field(freezer: LabServer) -> None:
    path = save(freezer, "misfit")
    tree = shorten_preset("evo/A").to_dict()
    tree["evolution"]["founders"] = [{"path": str(path)}]
    (error,) = post(freezer, "validate", experiment=tree, runs=1, seed=0).json()["errors"]
    assert error["path"] == "evolution.founders"
    assert "do not fit evo/A: their modules" in error["message"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"name": "../escape"}, "not a valid name"),
        ({"name": "a/b"}, "not a valid name"),
        ({"name": ""}, "not a valid name"),
        ({"name": "com1"}, "Windows reserves 'com1' for a device"),
        ({"agent": 20}, "has no agent 20"),
        ({"agent": "x"}, "must be a whole number"),
        ({"life": LIFE | {"run": 9}}, "has no run 9"),
        ({"life": LIFE | {"study": "../small"}}, "there is no study"),
        ({"life": 3}, "life must be an object"),
    ],
)
def test_an_invalid_request_writes_nothing(
    freezer: LabServer, change: dict[str, Any], message: str
) -> None:
    files = set(freezer.root.rglob("*"))
    response = post(freezer, "freezer", **({"life": LIFE, "name": "valid"} | change))
    assert response.status_code in (400, 404)
    assert message in response.json()["error"]
    assert set(freezer.root.rglob("*")) == files


def test_an_existing_file_is_not_overwritten(freezer: LabServer) -> None:
    path = save(freezer, "once")
    digest = hashlib.sha256(path.read_bytes()).digest()
    response = post(freezer, "freezer", life=LIFE | {"generation": 0}, name="once")
    assert "exists already" in response.json()["error"]
    assert hashlib.sha256(path.read_bytes()).digest() == digest


def test_a_lab_of_a_single_study_stores_no_agents(tmp_path: Path) -> None:
    make_small_study(tmp_path / "small", runs=1)
    with run_server(tmp_path / "small") as server:
        life = LIFE | {"study": ".", "run": 0}
        response = post(server, "freezer", life=life, name="agents")
        assert "open the lab with a folder that contains it" in response.json()["error"]
    assert not list(tmp_path.rglob("freezer"))


def test_a_large_population_is_refused(freezer: LabServer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("baldwinlab.lab.sources.freezer.MAX_FILE_BYTES", 100)
    response = post(freezer, "freezer", life=LIFE, name="large")
    assert "use `baldwinlab freeze`" in response.json()["error"]
    assert MAX_FILE_BYTES > 1_000_000


def test_a_damaged_file_is_listed_with_its_problem(freezer: LabServer) -> None:
    content = bytearray(save(freezer, "whole").read_bytes())
    content[-50] ^= 1
    (freezer.root / "damaged.nc").write_bytes(content)
    files = {file["name"]: file for file in get_json(freezer.address, "freezer")["files"]}
    assert "is no genome file" in files["damaged.nc"]["problem"]


def compete(server: LabServer, **body: Any) -> dict[str, Any]:
    files = {"a": "generation-2.nc", "b": "generation-0.nc"}
    response = CLIENT.post(f"{server.address}/api/compete", json=files | body)
    result: dict[str, Any] = response.json()
    return result


def test_a_competition_has_the_numbers_of_python(freezer: LabServer) -> None:
    files = [freezer.root / f"generation-{generation}.nc" for generation in (2, 0)]
    expected = bl.compete(*files, lives=4, seed=3)
    result = compete(freezer, lives=4, seed=3)
    assert result["energy"] == [expected.energy_a, expected.energy_b]
    assert result["outcome"] == "items eaten"
    assert [result[name] for name in ("difference", "low", "high")] == [
        expected.difference,
        expected.low,
        expected.high,
    ]


def test_agents_compete_in_another_condition(freezer: LabServer) -> None:
    result = compete(freezer, lives=1, condition="evo+self-taught/B")
    assert result["condition"] == "evo+self-taught/B"
    # One life has no interval.
    assert result["low"] is None


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"a": "../2.nc"}, "outside"),
        ({"a": "none.nc"}, "there is no genome file"),
        ({"b": "small/study.toml"}, "there is no genome file"),
        ({"lives": 0}, "lives = 0 must be"),
        ({"lives": 201}, "at most 200"),
        ({"condition": "/etc/hostname"}, "must be a preset"),
        ({"condition": "evo/A"}, "do not fit evo/A"),
    ],
)
def test_an_invalid_competition_is_an_error(
    freezer: LabServer, change: dict[str, Any], message: str
) -> None:
    assert message in compete(freezer, **change)["error"]
