"""Tests of the list of studies and of their results."""

from __future__ import annotations

import json
import os
import shlex
import shutil
from pathlib import Path
from unittest.mock import ANY

import numpy as np
import pytest

from baldwinlab import papers
from baldwinlab.analysis.claims import claim_records, evaluate_claims
from baldwinlab.analysis.statistics import fitness, intervals
from baldwinlab.api.publish import lab_results
from baldwinlab.experiment import Experiment, registry
from baldwinlab.experiment.registry import EXECUTION_HINT
from baldwinlab.lab import Lab
from baldwinlab.lab.sources import results
from baldwinlab.lab.sources.live import Live
from baldwinlab.lab.sources.studies import (
    describe_missing_parts,
    find_study,
    list_studies,
    list_study_names,
    summarize,
)
from baldwinlab.parts import load_file
from baldwinlab.simulation.simulate import simulate
from baldwinlab.studies.creation import create_study
from baldwinlab.studies.open import open_runs
from baldwinlab.studies.status import write_claims
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.study_file import stored_source
from tests.lab.client import LabServer, get_error, get_json
from tests.lab.conftest import hawks_study, run_server
from tests.small_studies import make_small_study, shorten_preset


def test_a_study_can_be_the_folder_itself_or_be_in_another_study(tmp_path: Path) -> None:
    create_study(tmp_path, [shorten_preset()], 1)
    create_study(tmp_path / "variants" / "deep", [shorten_preset()], 2)
    assert list(list_study_names(tmp_path)) == [".", "variants/deep"]
    lab = Lab(tmp_path, Live())
    assert find_study(lab, ".").seed == 1
    assert find_study(lab, "variants/deep").seed == 2


def test_a_missing_folder_has_no_studies(tmp_path: Path) -> None:
    assert list(list_study_names(tmp_path / "results")) == []


def test_a_replaced_study_is_read_again(tmp_path: Path) -> None:
    lab = Lab(tmp_path, Live())
    create_study(tmp_path / "it", [shorten_preset()], 1)
    assert find_study(lab, "it").seed == 1
    shutil.rmtree(tmp_path / "it")
    create_study(tmp_path / "it", [shorten_preset()], 2)
    assert find_study(lab, "it").seed == 2


def test_the_list_of_studies_contains_conditions_and_runs(lab_server: LabServer) -> None:
    studies_list = get_json(lab_server.address, "studies")["studies"]
    (summary,) = [study for study in studies_list if study["id"] == "small"]
    sizes = {
        "runs": [0, 1],
        "generations": 3,
        "agents": 20,
        "steps": 300,
        "alleles": [],
        "views": [],
    }
    learners = ("evo", "evo+self-taught")
    conditions = [
        {
            "name": f"{name}/A",
            "title": f"{name}/A",
            "learner": name,
            "learns": name != "evo",
            "map": "your map",
            "variant": "",
            "world": ANY,
            "shown": False,
            **sizes,
        }
        for name in learners
    ]
    records = (lab_server.root / "small" / "runs").rglob("*.nc")
    assert summary.pop("modified") == max(path.stat().st_mtime_ns for path in records) / 1e9
    assert summary == {
        "id": "small",
        "argument": str(lab_server.root / "small"),
        "seed": 5,
        "paper": "",
        "question": "",
        "conditions": conditions,
        "problem": None,
        "missing": "",
        "report": False,
    }


def test_the_study_of_a_paper_has_the_question_of_its_card(tmp_path: Path) -> None:
    create_study(tmp_path / "study", [shorten_preset("evo/B")], 1, paper="le-2019")
    question = summarize(Lab(tmp_path, Live()), "study")["question"]
    card = papers.load("le-2019").card
    assert card is not None
    assert question == card.question
    assert question.endswith("?")


def test_an_unreadable_study_is_listed_with_the_reason(tmp_path: Path) -> None:
    create_study(tmp_path / "sound", [shorten_preset()], 1)
    (tmp_path / "torn").mkdir()
    (tmp_path / "torn" / "study.toml").write_text("format = 3\nseed")
    (tmp_path / "odd").mkdir()
    (tmp_path / "odd" / "study.toml").write_text("format = 3\nseed = 1\nconditions = 3")
    create_study(tmp_path / "lacking", [shorten_preset()], 1)
    shutil.rmtree(tmp_path / "lacking" / "runs")
    with run_server(tmp_path) as server:
        problems = {
            study["id"]: study["problem"]
            for study in get_json(server.address, "studies")["studies"]
        }
        assert problems["sound"] is None
        assert problems["torn"].startswith(f"{tmp_path}/torn/study.toml cannot be read: ")
        assert problems["odd"].startswith(f"{tmp_path}/odd/study.toml cannot be read: ")
        assert problems["lacking"].startswith(
            f"{tmp_path}/lacking/runs/evo+self-taught/A/experiment.toml cannot be read: "
        )
        query = {"study": "torn", "condition": "evo/A", "run": 0, "generation": 0}
        assert get_error(server.address, "recording", 400, **query) == problems["torn"]
        assert get_error(server.address, "results", 400, study="torn") == problems["torn"]


def test_a_study_whose_model_is_not_loaded_is_listed_with_the_command_that_loads_it(
    tmp_path: Path,
) -> None:
    create_study(tmp_path / "sound", [shorten_preset()], 1)
    with hawks_study(tmp_path / "hawks") as study:
        lab = Lab(tmp_path, Live(), command=("baldwinlab", "lab", "a folder"))
        (hawks, sound) = (summarize(lab, name) for name in ("hawks", "sound"))
        assert (sound["problem"], sound["missing"]) == (None, "")
        assert [condition["runs"] for condition in hawks["conditions"]] == [[0]]
        message, command = hawks["missing"].split(f", {EXECUTION_HINT}: ")
        assert message.startswith(
            "The fitness debt and the model hawks-and-doves of this study are not loaded. "
        )
        *words, option, file = shlex.split(command)
        assert (words, option) == (["baldwinlab", "lab", "a folder"], "--part")
        load_file(file)
        assert describe_missing_parts(lab, StudyStore(study.directory)) == ""
        registry.remove("fitness", "debt")
        stored_source(study.directory, "fitness", "debt").write_text("# changed")
        changed = summarize(lab, "hawks")["missing"]
        assert "(FILE is the file with the fitness debt)" in changed
        assert changed.endswith(": baldwinlab lab 'a folder' --part FILE")


def test_the_newest_study_is_that_of_the_last_run(tmp_path: Path) -> None:
    older, newer = (
        make_small_study(tmp_path / name, [shorten_preset()], runs=1) for name in ("a", "b")
    )
    # A report or a session is written long after the last run.
    for second, study in enumerate((older, newer), start=1):
        os.utime(study.path("evo+self-taught/A", 0), (second, second))
    os.utime(older.directory, (9, 9))
    lab = Lab(tmp_path, Live())
    assert [summarize(lab, name)["modified"] for name in ("a", "b")] == [1, 2]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="the platform has no named pipes")
def test_a_pipe_instead_of_a_file_is_reported_without_waiting(tmp_path: Path) -> None:
    (tmp_path / "pipe").mkdir()
    os.mkfifo(tmp_path / "pipe" / "study.toml")
    for name, file in (
        ("record", "runs/evo+self-taught/A/0000.nc"),
        ("claims", "claims.json"),
        ("paper", "paper/paper.toml"),
    ):
        study = make_small_study(tmp_path / name, [shorten_preset()], runs=1)
        (study.directory / file).unlink(missing_ok=True)
        (study.directory / file).parent.mkdir(exist_ok=True)
        os.mkfifo(study.directory / file)
    with run_server(tmp_path) as server:
        problems = {
            study["id"]: study["problem"]
            for study in get_json(server.address, "studies")["studies"]
        }
        assert problems["pipe"].endswith("study.toml cannot be read: it is not a regular file")
        assert "0000.nc has the name of a record but is not a file" in problems["record"]
        assert (problems["claims"], problems["paper"]) == (None, None)
        results = get_json(server.address, "results", study="claims")
        assert results["claims"] == []
        assert "claims.json cannot be read: it is not a regular file" in results["problem"]


@pytest.mark.parametrize("file", ["study.toml", "runs/evo+self-taught/A/experiment.toml"])
def test_a_study_with_too_many_nested_levels_is_listed_with_the_reason(
    tmp_path: Path, file: str
) -> None:
    create_study(tmp_path / "it", [shorten_preset()], 1)
    (tmp_path / "it" / file).write_text("deep = " + "[" * 5000 + "]" * 5000)
    with run_server(tmp_path) as server:
        (summary,) = get_json(server.address, "studies")["studies"]
    assert f"{file} cannot be read: " in summary["problem"]


def test_factors_are_the_settings_that_differ_between_conditions(
    lab_server: LabServer,
) -> None:
    assert get_json(lab_server.address, "results", study="small")["factors"] == {
        "learner": ["evo", "evo+self-taught"]
    }


def test_results_are_stored_with_the_report_and_used_while_they_are_current(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = make_small_study(tmp_path / "it", runs=1)
    stored_results = results.load_results(Lab(tmp_path, Live()), {"study": "it"})
    lab_results.cache_results(study)
    with monkeypatch.context() as patch:
        # Without this function, the results cannot be computed again.
        patch.setattr(lab_results, "compute_results", None)
        assert results.load_results(Lab(tmp_path, Live()), {"study": "it"}) == stored_results
    cache = tmp_path / "it" / lab_results.CACHE_FILE
    renamed = cache.read_bytes().replace(b'"typical_run"', b'"typical_ran"')
    for content in (b"{", b"[1]", renamed):
        cache.write_bytes(content)
        assert results.load_results(Lab(tmp_path, Live()), {"study": "it"}) == stored_results
    lab_results.cache_results(study)
    study.write("evo/A", 1, simulate(shorten_preset("evo/A"), seed=5, run=1))
    new_results = json.loads(results.load_results(Lab(tmp_path, Live()), {"study": "it"}))
    rows = [(row["condition"], row["run"]) for row in new_results["runs"]["rows"]]
    assert rows == [("evo/A", 0), ("evo/A", 1), ("evo+self-taught/A", 0)]


@pytest.mark.parametrize("measure", ["best", "mean", "share"])
def test_results_are_those_of_the_report(lab_server: LabServer, measure: str) -> None:
    study = open_runs(lab_server.root / "small")
    results = get_json(lab_server.address, "results", study="small")
    assert results["conditions"] == ["evo/A", "evo+self-taught/A"]
    assert results["generation"] == [0, 1, 2]
    center, low, high = intervals.interval_of_median(fitness.MEASURES[measure](study))
    for name in results["conditions"]:
        curve = results["curves"][name][measure]
        for part, values in (("center", center), ("low", low), ("high", high)):
            # Two runs have no interval, which is null.
            numbers = np.array(curve[part], float)
            assert np.array_equal(numbers, values.sel(condition=name), equal_nan=True)
        rows = [row for row in results["runs"]["rows"] if row["condition"] == name]
        finals = fitness.final(study, measure).sel(condition=name)
        assert [row["run"] for row in rows] == finals["run"].values.tolist()
        assert [row[measure] for row in rows] == finals.values.tolist()
        assert results["typical_run"][name] == fitness.typical_run(study, name)
        assert get_json(lab_server.address, "typical", study="small", condition=name) == {
            "run": fitness.typical_run(study, name)
        }


def test_missing_numbers_are_null_and_conditions_without_runs_are_omitted(
    tmp_path: Path,
) -> None:
    short = shorten_preset("evo/A").replace(name="short", evolution={"generations": 2})
    study = create_study(tmp_path / "it", [shorten_preset("evo/A"), short, shorten_preset()], 5)
    for experiment in (shorten_preset("evo/A"), short):
        study.write(experiment.name, 0, simulate(experiment, seed=5))
    with run_server(tmp_path) as server:
        results = get_json(server.address, "results", study="it")
    assert results["conditions"] == ["evo/A", "short"]
    assert results["curves"]["short"]["mean"]["center"][2] is None
    assert results["curves"]["evo/A"]["mean"]["low"] == [None] * 3
    (row,) = (row for row in results["runs"]["rows"] if row["condition"] == "short")
    assert row["run"] == 0
    assert row["mean"] is not None


def test_a_study_without_runs_has_empty_results(tmp_path: Path) -> None:
    create_study(tmp_path / "it", [shorten_preset()], 1)
    with run_server(tmp_path) as server:
        results = get_json(server.address, "results", study="it")
        query = {"study": "it", "condition": "evo+self-taught/A", "run": 0, "generation": 0}
        recording_message = get_error(server.address, "recording", 404, **query)
        typical_message = get_error(
            server.address, "typical", 404, study="it", condition="evo+self-taught/A"
        )
    assert typical_message == f"{tmp_path}/it has no run of evo+self-taught/A"
    assert (
        recording_message
        == f"{tmp_path}/it has no run 0 of evo+self-taught/A; no run is stored yet"
    )
    assert results.pop("swept") is False
    names = ("factors", "curves", "typical_run")
    assert results == {
        "conditions": [],
        "generation": [],
        "claims": [],
        "problem": None,
        **{name: {} for name in names},
    }


def test_claims_are_those_of_the_report_and_are_read_again_after_a_change(
    lab_server: LabServer, tmp_path: Path
) -> None:
    shutil.copytree(lab_server.root / "small", tmp_path / "it")
    study = open_runs(tmp_path / "it")
    with run_server(tmp_path) as server:
        assert get_json(server.address, "results", study="it")["claims"] == []
        written = claim_records(evaluate_claims(study))
        write_claims(StudyStore(tmp_path / "it"), written)
        assert get_json(server.address, "results", study="it")["claims"] == written != []
        (tmp_path / "it" / "claims.json").write_text("[{")
        results = get_json(server.address, "results", study="it")
        assert results["claims"] == []
        assert results["curves"]
        assert results["problem"].startswith(f"{tmp_path}/it/claims.json cannot be read: ")
        assert results["problem"].endswith(f"; `baldwinlab report {tmp_path}/it` makes it again")


def test_an_unchanged_study_is_read_once_among_hundreds(tmp_path: Path) -> None:
    create_study(tmp_path / "0", [shorten_preset()], 1)
    for number in range(1, 300):
        shutil.copytree(tmp_path / "0", tmp_path / str(number))
    lab = Lab(tmp_path, Live())
    studies = [find_study(lab, str(number)) for number in range(300)]
    assert all(find_study(lab, str(number)) is study for number, study in enumerate(studies))


def test_a_fault_in_a_study_or_in_its_name_is_a_line_of_the_list(
    tmp_path: Path,
) -> None:
    create_study(tmp_path / "sound", [shorten_preset()], 1)
    shutil.copytree(tmp_path / "sound", tmp_path / "faulty")
    shutil.copytree(tmp_path / "sound", tmp_path / os.fsdecode(b"\xff"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Experiment, "learns", property(lambda experiment: 1 / 0))
        faulty = summarize(Lab(tmp_path, Live()), "faulty")
    assert faulty["problem"] == "faulty cannot be read: division by zero"
    summaries = list_studies(Lab(tmp_path, Live()), {})["studies"]
    assert [(summary["id"], summary["problem"]) for summary in summaries] == [
        ("faulty", None),
        ("sound", None),
        ("\\udcff", "the name \\udcff is not UTF-8; rename the folder"),
    ]


def test_a_link_to_a_study_is_a_line_of_the_list(tmp_path: Path) -> None:
    create_study(tmp_path / "outside", [shorten_preset()], 1)
    root = tmp_path / "lab"
    root.mkdir()
    (root / "link").symlink_to(tmp_path / "outside")
    [summary] = list_studies(Lab(root, Live()), {})["studies"]
    assert summary["id"] == "link"
    assert "is outside" in summary["problem"]
