"""The page of all papers that are stored, made by its command."""

from __future__ import annotations

import json
from pathlib import Path
from shutil import rmtree

import pytest

from baldwinlab import papers
from baldwinlab.gallery.publish import _percent
from tests.commands import Command


def reproduce(command: Command, name: str, *words: str) -> None:
    assert command("reproduce", name, "--runs", "2", "--generations", "4", *words).code == 0


def test_papers_that_are_stored_stand_beside_each_other(command: Command) -> None:
    reproduce(command, "mayley-1996", "--out", "all/mayley")
    reproduce(command, "hinton-nowlan-1987", "--out", "all/needle")
    done = command("gallery", "all")
    assert done.code == 0 and "all/gallery.html" in done.out
    page, record = Path("all/gallery.html").read_text(), json.loads(Path("all/gallery.json").read_text())
    assert [entry["paper"] for entry in record["papers"]] == ["hinton-nowlan-1987", "mayley-1996"], "in the order of their years"
    systems = {system["condition"]: system for system in record["papers"][1]["systems"]}
    assert systems["climbing/smooth"]["rival"] == systems["costly-climbing/smooth"]["rival"] == "not-climbing/smooth"
    assert systems["climbing/smooth"]["answers"]["gain"]["median"] > 0, "who climbs gains by it"
    assert set(record["papers"][1]["claims"]) == {"M1", "M2", "M3", "M4"}
    assert "climbing/smooth" in page and "undecided" in page
    assert {path.name for path in Path("all/figures").iterdir()} == {"gallery.svg", "gallery.png", "gallery.csv"}
    assert command("gallery", "all", "--out", "page.html").code == 0 and Path("page.html").exists()


def test_of_two_studies_of_a_paper_that_with_more_runs_counts(command: Command) -> None:
    command("reproduce", "mayley-1996", "--runs", "3", "--generations", "3", "--out", "all/a-larger")
    command("reproduce", "mayley-1996", "--runs", "2", "--generations", "3", "--out", "all/b-smaller")
    command("gallery", "all")
    (entry,) = json.loads(Path("all/gallery.json").read_text())["papers"]
    assert (entry["study"], entry["runs"]) == ("a-larger", 3)


def test_a_study_without_assays_is_told(command: Command) -> None:
    reproduce(command, "mayley-1996", "--out", "all/mayley")
    rmtree("all/mayley/assays")
    assert command("gallery", "all").code == 0
    assert "not stored of mayley-1996" in Path("all/gallery.html").read_text()


@pytest.mark.parametrize("folder", ["nothing", "empty"])
def test_a_folder_without_studies_is_refused_in_a_sentence(command: Command, folder: str) -> None:
    Path("empty").mkdir()
    done = command("gallery", folder)
    assert done.code == 2 and f"{folder} holds no study of a paper" in done.err and "baldwinlab reproduce" in done.err


def test_a_page_is_never_written_over_another_file(command: Command) -> None:
    reproduce(command, "mayley-1996", "--out", "all/mayley")
    Path("thesis.html").write_text("mine")
    assert command("gallery", "all", "--out", "thesis.html").code == 2
    assert Path("thesis.html").read_text() == "mine"


def test_percents_are_whole_with_a_sign() -> None:
    assert [_percent(share) for share in (0.123, -0.034, 0.001, -0.001, 12.5, float("nan"))] == [
        "+12",
        "−3",
        "0",
        "0",
        "+1,250",
        "–",
    ]


@pytest.mark.parametrize("name", papers.built_in())
def test_every_paper_names_conditions_that_it_has_and_that_learn(name: str) -> None:
    paper = papers.load(name)
    assert all(paper.experiment(condition).learns for condition in paper.about.compared)


@pytest.mark.nightly  # minutes
def test_all_papers_are_reproduced_by_one_command(command: Command) -> None:
    assert command("reproduce", "all", "--runs", "2", "--generations", "3", "--steps", "40", "--out", "all").code == 0
    record = json.loads(Path("all/gallery.json").read_text())
    assert {entry["paper"] for entry in record["papers"]} == set(papers.built_in())
