"""No command writes through a link that leads out of a study. A study itself can be a link."""

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
from tests.studies.completion import read_files
from tests.studies.test_read_only import RUN_ONE_MORE

SESSION = {"seconds": 1.0, "compile_seconds": 0.5, "workers": 1, "agent_steps": 3}


@pytest.fixture
def outside(tmp_path: Path) -> Path:
    """Return a folder outside of the study, with files that have the names of a study's files."""
    folder = tmp_path / "outside"
    folder.mkdir()
    for name in ("fitness.svg", "sessions.jsonl", "0000.nc", "study.toml"):
        (folder / name).write_text("years of work\n")
    return folder


@pytest.mark.parametrize(
    "link", ["figures", "assays", "assays/innate", "runs/evo/A", "runs", "parts", "paper"]
)
@pytest.mark.parametrize("has_study", [False, True])
def test_a_linked_folder_inside_a_study_is_not_written_to(
    tmp_path: Path, outside: Path, link: str, has_study: bool
) -> None:
    """The target of the link can be a study."""
    study = tmp_path / "study"
    study.mkdir()
    (study / "study.toml").write_text("")
    (study / link).parent.mkdir(parents=True, exist_ok=True)
    (study / link).symlink_to(outside)
    if not has_study:
        (outside / "study.toml").unlink()
    before = read_files(outside)
    for name in ("fitness.svg", "new.csv", "below/new.csv"):
        with pytest.raises(
            RefusedError, match=f"{study / link} is a link that leads out of the study {study}"
        ):
            write_atomically(study / link / name, b"new")
    assert read_files(outside) == before


@pytest.mark.parametrize("link_type", ["symbolic", "hard"])
def test_a_linked_file_of_sessions_is_not_changed(
    tmp_path: Path, outside: Path, link_type: str
) -> None:
    study = create_study(tmp_path / "study", [shorten_preset("evo/A")], seed=1)
    path = study.directory / "sessions.jsonl"
    if link_type == "symbolic":
        path.symlink_to(outside / "sessions.jsonl")
        with pytest.raises(RefusedError, match=r"sessions\.jsonl cannot be written: it is a link"):
            study.add_session(SESSION)
    else:
        os.link(outside / "sessions.jsonl", path)
        study.add_session(SESSION)
        assert list(study.sessions()) == [SESSION]
    assert (outside / "sessions.jsonl").read_text() == "years of work\n"


def test_no_record_is_moved_and_no_study_created_through_a_link(
    tmp_path: Path, outside: Path
) -> None:
    (outside / "study.toml").unlink()
    study = create_study(tmp_path / "study", [shorten_preset("evo/A")], seed=1)
    folder = study.path("evo/A", 0).parent
    (folder / "experiment.toml").unlink()
    folder.rmdir()
    folder.symlink_to(outside)
    (tmp_path / "new").mkdir()
    (tmp_path / "new" / "runs").symlink_to(outside)
    before = read_files(outside)
    with pytest.raises(RefusedError, match="is a link that leads out of the study"):
        study.rename_damaged(study.path("evo/A", 0))
    with pytest.raises(RefusedError, match="runs is a link that leads out of the study"):
        create_study(tmp_path / "new", [shorten_preset("evo/A")], seed=1)
    assert read_files(outside) == before


def test_a_cyclic_link_is_refused(tmp_path: Path) -> None:
    study = create_study(tmp_path, [shorten_preset("evo/A")], seed=1)
    (tmp_path / "figures").symlink_to("figures")
    with pytest.raises(OSError, match="figures"):
        write_atomically(study.directory / "figures" / "fitness.svg", b"new")


def test_links_inside_a_study_and_explicit_parent_paths_are_followed(
    tmp_path: Path,
) -> None:
    study = create_study(tmp_path / "study", [shorten_preset("evo/A")], seed=1).directory
    (study / "pictures").mkdir()
    (study / "figures").symlink_to("pictures")
    write_atomically(study / "figures" / "fitness.svg", b"new")
    assert (study / "pictures" / "fitness.svg").read_bytes() == b"new"
    write_atomically(study / ".." / "page.html", b"page")
    assert (tmp_path / "page.html").read_bytes() == b"page"


def test_a_study_opened_through_a_link_is_written_to(tmp_path: Path) -> None:
    (tmp_path / "disk").mkdir()
    (tmp_path / "results").symlink_to("disk")
    study = make_small_study(tmp_path / "results" / "study", [shorten_preset("evo/A")], runs=1)
    assert len(read_records(tmp_path / "disk" / "study")) == 1
    assert len(list(study.sessions())) == 1
    (tmp_path / "mine").symlink_to(tmp_path / "disk" / "study")
    linked = StudyStore(tmp_path / "mine")
    linked.write("evo/A", 1, simulate(shorten_preset("evo/A"), seed=5, run=1))
    append_line(linked.directory / "sessions.jsonl", "{}", SESSIONS_FILE)
    assert len(read_records(tmp_path / "disk" / "study")) == 2


def test_a_report_does_not_write_through_a_link(
    command: Command, tmp_path: Path, outside: Path
) -> None:
    make_small_study(tmp_path / "study", [shorten_preset("evo/A")], runs=1)
    (tmp_path / "study" / "figures").symlink_to(outside)
    before = read_files(outside)
    study_before = read_files(tmp_path / "study")
    result = command("report", "study")
    assert result.code == 2
    assert "figures is a link that leads out of the study" in result.err
    assert read_files(outside) == before
    assert read_files(tmp_path / "study") == study_before


@pytest.mark.parametrize("link", ["sessions.jsonl", "assays"])
def test_a_link_is_refused_before_anything_is_computed(
    command: Command, tmp_path: Path, outside: Path, link: str
) -> None:
    make_small_study(tmp_path / "study", [shorten_preset("evo/A")], runs=1)
    path = tmp_path / "study" / link
    path.unlink(missing_ok=True)
    path.symlink_to(outside / link if link == "sessions.jsonl" else outside)
    before = read_files(outside)
    study_before = read_records(tmp_path / "study")
    arguments = {"assays": ("assay", "study", "--assays", "innate")}.get(link, RUN_ONE_MORE)
    result = command(*arguments)
    assert result.code == 2
    assert f"{path.relative_to(tmp_path)}" in result.err
    assert "is a link" in result.err
    assert read_files(outside) == before
    assert read_records(tmp_path / "study") == study_before
