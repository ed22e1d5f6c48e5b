"""A paper reproduced with a changed model: every place that shows its results says so."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import baldwinlab as bl
from baldwinlab.api.publish.gallery_entries import find_studies
from baldwinlab.studies.store import StudyStore
from tests.commands import Command

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
SET = ("--set", "hinton_nowlan.loci=4", "population.size=30")
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


def heading(study: Path) -> str:
    return (study / "report.html").read_text().partition("<h1>")[2].partition("</h1>")[0]


def test_a_changed_model_is_marked_in_the_study_its_report_its_claims_and_the_terminal(
    command: Command, paper: str
) -> None:
    done = command("reproduce", paper, *SET)
    assert done.code == 0, done.err
    (study,) = Path("results").iterdir()
    assert study.name == "needle-hinton_nowlan.loci=4-population.size=30"
    experiments = StudyStore(study).experiments.values()
    assert {(one.of_model.loci, one.population.size) for one in experiments} == {(4, 30)}
    assert list(StudyStore(study).changes) == CHANGES
    assert heading(study) == "On needles: a changed model"
    assert NOTE in (study / "report.html").read_text()
    claims = json.loads((study / "claims.json").read_text("utf-8"))["claims"]
    assert [claim["changes"] for claim in claims] == [CHANGES]
    for shown in (done.out, command("claims", str(study)).out, command("report", str(study)).out):
        assert "in a changed model" in shown and NOTE in " ".join(shown.split())
    again = command("reproduce", paper, *SET)
    assert "all 4 runs are already stored" in again.out
    refused = command("reproduce", paper, "--out", str(study))
    assert refused.code == 2 and "hinton_nowlan.loci of guessing is 4, not 5" in refused.err


def test_the_model_of_the_paper_is_not_marked(command: Command, paper: str) -> None:
    done = command("reproduce", paper, "--set", "hinton_nowlan.loci=5", "--out", "same")
    assert done.code == 0 and "changed model" not in done.out
    assert StudyStore(Path("same")).changes == ()
    assert heading(Path("same")) == "On needles: a reproduction"
    assert "changes" not in json.loads(Path("same/claims.json").read_text("utf-8"))["claims"][0]


def test_the_gallery_marks_a_changed_model_and_prefers_the_model_of_the_paper(
    command: Command, paper: str
) -> None:
    assert command("reproduce", paper, *SET, "--runs", "3", "--out", "all/changed").code == 0
    done = command("gallery", "all")
    assert (
        "needle is a changed model (hinton_nowlan.loci=4, population.size=30) and is included."
        in done.out
    )
    assert "needle (changed model)" in Path("all/gallery.html").read_text("utf-8")
    assert (
        json.loads(Path("all/gallery.json").read_text("utf-8"))["papers"][0]["changes"] == CHANGES
    )
    assert command("reproduce", paper, "--runs", "2", "--out", "all/plain").code == 0
    assert find_studies(Path("all"))["needle"].directory.name == "plain"
    assert "changed model" not in command("gallery", "all").out


def test_python_changes_a_model_and_shorter_runs_change_it_too(paper: str, tmp_path: Path) -> None:
    study = bl.reproduce(
        paper, runs=1, generations=2, set={"population": {"size": 10}}, out=tmp_path / "short"
    )
    assert StudyStore(study.directory).changes == ("evolution.generations=2", "population.size=10")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--set", "hinton_nowlan.length=4"), "hinton_nowlan.length: there is no 'length'"),
        (
            ("--set", "hinton_nowlan.loci=0"),
            "hinton_nowlan.loci = 0: input should be greater than or equal to 1",
        ),
        (("--set", "evolution.mutation_size=0.5"), "evolution.mutation_size: does nothing with"),
    ],
)
def test_a_change_that_cannot_be_made_is_refused_before_anything_is_written(
    command: Command, paper: str, words: tuple[str, ...], message: str
) -> None:
    done = command("reproduce", paper, *words)
    assert done.code == 2 and message in done.err
    assert not Path("results").exists()


def test_all_papers_cannot_be_changed_at_once(command: Command) -> None:
    done = command("reproduce", "all", "--set", "population.size=3")
    assert done.code == 2 and "--set population.size=3 applies to one paper only" in done.err


def test_a_study_whose_changes_are_no_texts_is_refused(paper: str, tmp_path: Path) -> None:
    study = bl.reproduce(paper, runs=1, out=tmp_path / "study")
    facts = study.directory / "study.toml"
    text = facts.read_text().partition("# SHA-256")[0].replace("format = 3", "format = 2")
    facts.write_text(text.replace("seed = 0", "seed = 0\nchanges = 3"))
    with pytest.raises(
        bl.StudyError,
        match=r"study\.toml cannot be read: changes = 3 must be a list of assignments",
    ):
        StudyStore(study.directory)
