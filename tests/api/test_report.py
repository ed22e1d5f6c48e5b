"""Custom claims, evaluated with the runs of a study."""

from __future__ import annotations

import json
from pathlib import Path
from shutil import copytree
from typing import Any

import pytest

from baldwinlab import papers
from baldwinlab.api.run_options import RunOptions
from baldwinlab.api.run_study import StudyRequest, run_missing
from tests.commands import Command
from tests.studies.completion import read_files

CLAIM = """
[[claims]]
id = "mine"
title = "Climbers are fitter"
claim = "Strings that climb have a higher fitness than strings that do not."
rule = "greater"
comparisons = [{ a = "climbing/smooth", b = "not-climbing/smooth", measure = "mean" }]

[[claims]]
id = "measure-of-the-model"
title = "Climbers change bits"
claim = "Climbers change at least one bit during their lifetime."
rule = "at_least"
comparisons = [{ a = "climbing/smooth", measure = "changed", bound = 1 }]
"""


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    paper = papers.load("mayley-1996")
    experiments = [
        experiment.replace(evolution={"generations": 3}) for experiment in paper.experiments()
    ]
    folder = tmp_path_factory.mktemp("claims") / "study"
    run_missing(StudyRequest(experiments, folder, runs=8, seed=0, paper=paper), RunOptions())
    return folder


@pytest.fixture
def study(stored: Path, tmp_path: Path, command: Command) -> Path:
    copytree(stored, "study")
    return Path("study")


def test_a_file_of_claims_is_evaluated_with_the_rules_of_papers(
    command: Command, study: Path
) -> None:
    Path("mine.toml").write_text(CLAIM, encoding="utf-8")
    before = read_files(study)
    options = ("--last-generations", "2", "--out", "verdicts.json")
    done = command("report", "study", "--claims", "mine.toml", *options)
    assert done.code == 0
    assert "The claims of mine.toml" in done.out
    assert "paper" not in done.out
    results = {result["id"]: result for result in read_results("verdicts.json")}
    assert results["mine"]["verdict"] == "holds"
    assert results["mine"]["effect"] > 0
    assert results["measure-of-the-model"]["verdict"] == "holds"
    assert results["measure-of-the-model"]["effect"] > 1
    # The command does not change the study.
    assert read_files(study) == before
    done = command("report", "study", "--claims", "--last-generations", "3", "--out", "paper.json")
    assert done.code == 0
    assert "The claims of mayley-1996" in done.out
    assert [result["id"] for result in read_results("paper.json")] == ["M1", "M2", "M3", "M4"]


def read_results(path: str) -> Any:
    return json.loads(Path(path).read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('climbing/smooth", b', 'climbing/smoth", b', "did you mean 'climbing/smooth'"),
        ('measure = "changed"', 'measure = "changd"', "did you mean 'changed'"),
        ('rule = "greater"', 'rule = "more"', "mine.toml: claims.0"),
        ("[[claims]]", "[[claim]]", "mine.toml"),
    ],
)
def test_an_invalid_claim_is_refused_with_the_reason(
    command: Command, study: Path, old: str, new: str, message: str
) -> None:
    Path("mine.toml").write_text(CLAIM.replace(old, new), encoding="utf-8")
    done = command("report", "study", "--claims", "mine.toml", "--out", "verdicts.json")
    assert done.code == 2
    assert message in done.err
    assert not Path("verdicts.json").exists()


def test_a_missing_file_and_a_missing_study_are_refused(command: Command, study: Path) -> None:
    missing = command("report", "study", "--claims", "nothing.toml")
    assert "nothing.toml does not exist" in missing.err
    assert command("report", "nowhere", "--claims", "nothing.toml").code == 2
    Path("thesis").write_text("mine", encoding="utf-8")
    assert command("report", "study", "--claims", "--out", "thesis").code == 2
    assert Path("thesis").read_text(encoding="utf-8") == "mine"


def test_options_of_the_report_do_not_apply_to_claims(command: Command, study: Path) -> None:
    for option in ("--baseline", "--paper"):
        done = command("report", "study", "--claims", option, "mayley-1996")
        message = f"{option} does not apply to --claims. Remove the option."
        assert (done.code, done.err) == (2, f"baldwinlab: {message}\n")


def test_the_verdicts_as_json_are_those_of_the_file(command: Command, study: Path) -> None:
    done = command("report", "study", "--claims", "mayley-1996", "--out", "file.json", "--json")
    assert done.code == 0 and "verdicts: file.json" in done.err
    assert json.loads(done.out) == read_results("file.json")
