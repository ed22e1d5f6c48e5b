"""Claims of one's own, held against a study that is not of their making."""

from __future__ import annotations

import json
from pathlib import Path
from shutil import copytree

import pytest

from baldwinlab import papers
from baldwinlab.api.run_options import RunOptions
from baldwinlab.api.run_study import StudyRequest, run_missing
from tests.commands import Command

CLAIM = """
[[claims]]
id = "mine"
title = "Who climbs is fitter in life"
claim = "Strings that climb end their lives fitter than strings that do not."
rule = "greater"
comparisons = [{ a = "climbing/smooth", b = "not-climbing/smooth", measure = "mean" }]

[[claims]]
id = "own-measure"
title = "They change some bits"
claim = "At last, climbers change a bit or more in life."
rule = "at_least"
comparisons = [{ a = "climbing/smooth", measure = "changed", bound = 1 }]
"""


@pytest.fixture(scope="module")
def lived(tmp_path_factory: pytest.TempPathFactory) -> Path:
    paper = papers.load("mayley-1996")
    experiments = [one.replace(evolution={"generations": 3}) for one in paper.experiments()]
    folder = tmp_path_factory.mktemp("claims") / "study"
    run_missing(StudyRequest(experiments, folder, runs=8, seed=0, paper=paper), RunOptions())
    return folder


@pytest.fixture
def study(lived: Path, tmp_path: Path, command: Command) -> Path:
    copytree(lived, "study")
    return Path("study")


def test_a_file_of_claims_is_decided_by_the_rules_of_papers(command: Command, study: Path) -> None:
    Path("mine.toml").write_text(CLAIM, encoding="utf-8")
    before = {path: path.read_bytes() for path in study.rglob("*") if path.is_file()}
    done = command(
        "claims",
        "study",
        "--claims",
        "mine.toml",
        "--last-generations",
        "2",
        "--out",
        "verdicts.json",
    )
    assert done.code == 0 and "The claims of mine.toml" in done.out and "paper" not in done.out
    found = {
        claim["id"]: claim
        for claim in json.loads(Path("verdicts.json").read_text(encoding="utf-8"))
    }
    assert found["mine"]["verdict"] == "holds" and found["mine"]["effect"] > 0
    assert found["own-measure"]["verdict"] == "holds" and found["own-measure"]["effect"] > 1
    assert before == {path: path.read_bytes() for path in study.rglob("*") if path.is_file()}, (
        "nothing of the study is written"
    )
    own = command("claims", "study", "--last-generations", "3", "--out", "again.json")
    assert own.code == 0 and "The claims of mayley-1996" in own.out
    assert [
        claim["id"] for claim in json.loads(Path("again.json").read_text(encoding="utf-8"))
    ] == ["M1", "M2", "M3", "M4"]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('climbing/smooth", b', 'climbing/smoth", b', "did you mean 'climbing/smooth'"),
        ('measure = "changed"', 'measure = "changd"', "did you mean 'changed'"),
        ('rule = "greater"', 'rule = "more"', "mine.toml: claims.0"),
        ("[[claims]]", "[[claim]]", "mine.toml"),
    ],
)
def test_a_claim_that_cannot_be_decided_is_refused_in_a_sentence(
    command: Command, study: Path, old: str, new: str, said: str
) -> None:
    Path("mine.toml").write_text(CLAIM.replace(old, new), encoding="utf-8")
    done = command("claims", "study", "--claims", "mine.toml", "--out", "verdicts.json")
    assert done.code == 2 and said in done.err and not Path("verdicts.json").exists()


def test_what_is_not_there_is_refused(command: Command, study: Path) -> None:
    assert (
        "nothing.toml does not exist" in command("claims", "study", "--claims", "nothing.toml").err
    )
    assert command("claims", "nowhere", "--claims", "nothing.toml").code == 2
    Path("thesis").write_text("mine", encoding="utf-8")
    assert (
        command("claims", "study", "--out", "thesis").code == 2
        and Path("thesis").read_text(encoding="utf-8") == "mine"
    )
