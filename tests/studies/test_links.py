"""A link inside a study never leads a write out of it; a study may itself be reached through a link."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from baldwinlab.core.errors import RefusedError
from baldwinlab.core.file_writing import append_line, write_atomically
from baldwinlab.core.files import SESSIONS_FILE
from baldwinlab.simulation.simulate import simulate
from baldwinlab.studies.creation import create_study
from baldwinlab.studies.store import StudyStore
from tests.commands import Command
from tests.small_studies import make_small_study, read_records, shorten_preset

SESSION = {"seconds": 1.0, "compile_seconds": 0.5, "workers": 1, "agent_steps": 3}


def snapshot(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


@pytest.fixture
def elsewhere(tmp_path: Path) -> Path:
    """A folder outside of the study, with a file of each name that a command may write."""
    folder = tmp_path / "elsewhere"
    folder.mkdir()
    for name in ("fitness.svg", "sessions.jsonl", "0000.nc", "study.toml"):
        (folder / name).write_text("years of work\n")
    return folder


@pytest.mark.parametrize(
    "link", ["figures", "assays", "assays/innate", "runs/evo/A", "runs", "parts", "paper"]
)
@pytest.mark.parametrize("has_study", [False, True])
def test_no_folder_that_is_a_link_is_written_to(
    tmp_path: Path, elsewhere: Path, link: str, has_study: bool
) -> None:
    """Also where the link leads to a folder that is a study itself."""
    study = tmp_path / "study"
    study.mkdir()
    (study / "study.toml").write_text("")
    (study / link).parent.mkdir(parents=True, exist_ok=True)
    (study / link).symlink_to(elsewhere)
    if not has_study:
        (elsewhere / "study.toml").unlink()
    before = snapshot(elsewhere)
    for name in ("fitness.svg", "new.csv", "below/new.csv"):
        with pytest.raises(
            RefusedError, match=f"{study / link} is a link that leads out of the study {study}"
        ):
            write_atomically(study / link / name, b"new")
    assert snapshot(elsewhere) == before


@pytest.mark.parametrize("make", ["symbolic", "hard"])
def test_sessions_elsewhere_are_not_changed(tmp_path: Path, elsewhere: Path, make: str) -> None:
    study = create_study(tmp_path / "study", [shorten_preset("evo/A")], seed=1)
    path = study.directory / "sessions.jsonl"
    if make == "symbolic":
        path.symlink_to(elsewhere / "sessions.jsonl")
        with pytest.raises(RefusedError, match=r"sessions\.jsonl cannot be written: it is a link"):
            study.add_session(SESSION)
    else:
        os.link(elsewhere / "sessions.jsonl", path)
        study.add_session(SESSION)
        assert list(study.sessions()) == [SESSION]
    assert (elsewhere / "sessions.jsonl").read_text() == "years of work\n"


def test_a_damaged_record_behind_a_link_is_not_moved(tmp_path: Path, elsewhere: Path) -> None:
    study = create_study(tmp_path / "study", [shorten_preset("evo/A")], seed=1)
    folder = study.path("evo/A", 0).parent
    (folder / "experiment.toml").unlink()
    folder.rmdir()
    folder.symlink_to(elsewhere)
    before = snapshot(elsewhere)
    with pytest.raises(RefusedError, match="is a link that leads out of the study"):
        study.set_aside("evo/A", 0)
    assert snapshot(elsewhere) == before


def test_no_study_is_created_through_a_link_inside_its_folder(
    tmp_path: Path, elsewhere: Path
) -> None:
    (elsewhere / "study.toml").unlink()
    (tmp_path / "study").mkdir()
    (tmp_path / "study" / "runs").symlink_to(elsewhere)
    before = snapshot(elsewhere)
    with pytest.raises(RefusedError, match="runs is a link that leads out of the study"):
        create_study(tmp_path / "study", [shorten_preset("evo/A")], seed=1)
    assert snapshot(elsewhere) == before


def test_a_link_that_leads_round_in_a_circle_is_refused(tmp_path: Path) -> None:
    study = create_study(tmp_path, [shorten_preset("evo/A")], seed=1)
    (tmp_path / "figures").symlink_to("figures")
    with pytest.raises(OSError, match="figures"):
        write_atomically(study.directory / "figures" / "fitness.svg", b"new")


def test_links_that_stay_inside_and_paths_that_leave_a_study_openly_are_followed(
    tmp_path: Path,
) -> None:
    study = create_study(tmp_path / "study", [shorten_preset("evo/A")], seed=1).directory
    (study / "pictures").mkdir()
    (study / "figures").symlink_to("pictures")
    write_atomically(study / "figures" / "fitness.svg", b"new")
    assert (study / "pictures" / "fitness.svg").read_bytes() == b"new"
    write_atomically(study / ".." / "page.html", b"page")
    assert (tmp_path / "page.html").read_bytes() == b"page"


def test_a_study_that_is_reached_through_a_link_is_written_to(tmp_path: Path) -> None:
    (tmp_path / "disk").mkdir()
    (tmp_path / "results").symlink_to("disk")
    study = make_small_study(tmp_path / "results" / "study", [shorten_preset("evo/A")], runs=1)
    assert len(read_records(tmp_path / "disk" / "study")) == 1
    assert len(list(study.sessions())) == 1
    (tmp_path / "mine").symlink_to(tmp_path / "disk" / "study")
    again = StudyStore(tmp_path / "mine")
    again.write("evo/A", 1, simulate(shorten_preset("evo/A"), seed=5, run=1))
    append_line(again.directory / "sessions.jsonl", "{}", SESSIONS_FILE)
    assert len(read_records(tmp_path / "disk" / "study")) == 2


def test_a_report_does_not_write_through_a_link(
    command: Command, tmp_path: Path, elsewhere: Path
) -> None:
    make_small_study(tmp_path / "study", [shorten_preset("evo/A")], runs=1)
    (tmp_path / "study" / "figures").symlink_to(elsewhere)
    before = snapshot(elsewhere)
    own = snapshot(tmp_path / "study")
    done = command("report", "study")
    assert done.code == 2
    assert "figures is a link that leads out of the study" in done.err
    assert snapshot(elsewhere) == before
    assert snapshot(tmp_path / "study") == own


@pytest.mark.parametrize("link", ["sessions.jsonl", "assays"])
def test_a_link_is_refused_before_anything_is_computed(
    command: Command, tmp_path: Path, elsewhere: Path, link: str
) -> None:
    make_small_study(tmp_path / "study", [shorten_preset("evo/A")], runs=1)
    path = tmp_path / "study" / link
    path.unlink(missing_ok=True)
    path.symlink_to(elsewhere / link if link == "sessions.jsonl" else elsewhere)
    before, own = snapshot(elsewhere), read_records(tmp_path / "study")
    settings = (
        "evolution.generations=3",
        "lifetime.steps=300",
        "world.start.x=400",
        "world.start.y=160",
    )
    again = ("run", "evo/A", "--set", *settings, "--seed", "5", "--runs", "2", "--out", "study")
    done = command(*(("assay", "study", "--assays", "innate") if link == "assays" else again))
    assert done.code == 2
    assert f"{path.relative_to(tmp_path)}" in done.err and "is a link" in done.err
    assert snapshot(elsewhere) == before
    assert read_records(tmp_path / "study") == own
