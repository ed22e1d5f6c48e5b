"""A paper reproduced with a changed model is marked in all of its results."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import baldwinlab as bl
from baldwinlab.api.publish.gallery_entries import find_studies
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.study_file import add_checksum
from tests.commands import Command

# Other tests draw these figures.
pytestmark = pytest.mark.usefixtures("placeholder_figures_of_module")

PAPER = """
name = "needle"
title = "On needles"
authors = ["A. Reader"]
year = 2026
citation = "A. Reader, On needles, 2026"
description = "strings that guess"
runs = 2
figures = ["fitness"]
assays = ["innate"]
"""
CONDITION = """
description = "strings"
model = "hinton-nowlan"
[hinton_nowlan]
loci = 5
trials = 20
guessing = {}
[population]
size = 20
[evolution]
generations = 3
"""
CLAIMS = """
[[claims]]
id = "N1"
title = "Strings that guess are fitter"
claim = "Strings that guess are fitter."
rule = "greater"
paper = "they are"
comparisons = [{ a = "guessing", b = "plain", measure = "mean" }]
"""
SET_OPTIONS = ("--set", "hinton_nowlan.loci=4", "population.size=30")
CHANGES = ["hinton_nowlan.loci=4", "population.size=30"]
NOTE = f"Changed model: {', '.join(CHANGES)}. No verdict here is about the model of the paper."


@pytest.fixture
def paper(tmp_path: Path) -> str:
    folder = tmp_path / "needle"
    (folder / "conditions").mkdir(parents=True)
    (folder / "paper.toml").write_text(PAPER)
    (folder / "claims.toml").write_text(CLAIMS)
    (folder / "words.toml").write_text('heading = "On needles: a reproduction"\n')
    for name, guesses in (("guessing", "true"), ("plain", "false")):
        (folder / "conditions" / f"{name}.toml").write_text(CONDITION.format(guesses))
    return str(folder)


def report_heading(study: Path) -> str:
    return (study / "report.html").read_text().partition("<h1>")[2].partition("</h1>")[0]


def test_a_changed_model_is_marked_in_the_study_report_claims_and_terminal(
    command: Command, paper: str
) -> None:
    result = command("reproduce", paper, *SET_OPTIONS)
    assert result.code == 0, result.err
    (study,) = Path("results").iterdir()
    assert study.name == "needle-hinton_nowlan.loci=4-population.size=30"
    experiments = StudyStore(study).experiments.values()
    settings = {(condition.model_part.loci, condition.population.size) for condition in experiments}
    assert settings == {(4, 30)}
    assert list(StudyStore(study).changes) == CHANGES
    assert report_heading(study) == "On needles: a changed model"
    assert NOTE in (study / "report.html").read_text()
    claims = json.loads((study / "claims.json").read_text("utf-8"))["claims"]
    assert [claim["changes"] for claim in claims] == [CHANGES]
    for output in (
        result.out,
        command("report", str(study), "--claims").out,
        command("report", str(study)).out,
    ):
        assert "in a changed model" in output
        assert NOTE in " ".join(output.split())
    repeated = command("reproduce", paper, *SET_OPTIONS)
    assert "4 runs stored, none to do" in repeated.out
    refused = command("reproduce", paper, "--out", str(study))
    assert refused.code == 2
    assert "hinton_nowlan.loci of guessing is 4, not 5" in refused.err


def test_the_model_of_the_paper_is_not_marked(command: Command, paper: str) -> None:
    result = command("reproduce", paper, "--set", "hinton_nowlan.loci=5", "--out", "same")
    assert result.code == 0
    assert "changed model" not in result.out
    assert StudyStore(Path("same")).changes == ()
    assert report_heading(Path("same")) == "On needles: a reproduction"
    assert "changes" not in json.loads(Path("same/claims.json").read_text("utf-8"))["claims"][0]


@pytest.mark.nightly
def test_the_gallery_marks_a_changed_model_and_prefers_the_model_of_the_paper(
    command: Command, paper: str
) -> None:
    assert (
        command("reproduce", paper, *SET_OPTIONS, "--runs", "3", "--out", "all/changed").code == 0
    )
    result = command("report", "all")
    assert (
        "needle is a changed model (hinton_nowlan.loci=4, population.size=30) and is included."
        in result.out
    )
    assert "needle (changed model)" in Path("all/gallery.html").read_text("utf-8")
    assert json.loads(Path("all/papers.json").read_text("utf-8"))["papers"][0]["changes"] == CHANGES
    assert command("reproduce", paper, "--runs", "2", "--out", "all/plain").code == 0
    assert find_studies(Path("all"))["needle"].directory.name == "plain"
    assert "changed model" not in command("report", "all").out


@pytest.mark.nightly
def test_settings_and_shorter_runs_in_python_are_changes_of_the_model(
    paper: str, tmp_path: Path
) -> None:
    study = bl.reproduce(
        paper, runs=1, generations=2, set={"population": {"size": 10}}, out=tmp_path / "short"
    )
    assert StudyStore(study.directory).changes == ("evolution.generations=2", "population.size=10")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("hinton_nowlan.length=4", "hinton_nowlan.length: there is no 'length'"),
        ("hinton_nowlan.loci=0", "hinton_nowlan.loci = 0: input should be greater than or equal"),
        ("evolution.mutation_size=0.5", "evolution.mutation_size: does nothing with"),
    ],
)
def test_an_invalid_change_is_refused_before_files_are_written(
    command: Command, paper: str, change: str, message: str
) -> None:
    result = command("reproduce", paper, "--set", change)
    assert result.code == 2
    assert message in result.err
    assert not Path("results").exists()


def test_changes_apply_to_a_single_paper(command: Command) -> None:
    result = command("reproduce", "--all", "--set", "population.size=3")
    assert result.code == 2
    assert "--set population.size=3 applies to one paper only" in result.err


def test_a_study_with_invalid_changes_is_refused(paper: str, tmp_path: Path) -> None:
    study = bl.reproduce(paper, runs=1, out=tmp_path / "study")
    facts = study.directory / "study.toml"
    text = facts.read_text().partition("# SHA-256")[0]
    facts.write_text(add_checksum(text.replace("seed = 0", "seed = 0\nchanges = 3")))
    with pytest.raises(
        bl.StudyError,
        match=r"study\.toml cannot be read: changes = 3: input should be a list",
    ):
        StudyStore(study.directory)
