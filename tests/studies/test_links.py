"""No command writes through a link that leads out of a study, or computes for a read-only study."""

from __future__ import annotations

import os
import re
import stat
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

import baldwinlab
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.file_writing import append_line, write_atomically
from baldwinlab.core.files import SESSIONS_FILE
from baldwinlab.simulation.simulate import simulate
from baldwinlab.studies.creation import create_study
from baldwinlab.studies.store import StudyStore
from tests.commands import Command
from tests.small_studies import make_small_study, read_records, shorten_preset
from tests.studies.completion import read_files

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


@pytest.mark.parametrize("name", ["parts", "inputs", "founders"])
def test_no_study_is_created_with_a_link_to_another_folder(
    tmp_path: Path, outside: Path, name: str
) -> None:
    (tmp_path / "new").mkdir()
    (tmp_path / "new" / name).symlink_to(outside)
    with pytest.raises(RefusedError, match=f"{name} is a link that leads out of the study"):
        create_study(tmp_path / "new", [shorten_preset("evo/A")], seed=1)
    assert not (tmp_path / "new" / "study.toml").exists()


def test_a_cyclic_link_is_refused(tmp_path: Path) -> None:
    study = create_study(tmp_path, [shorten_preset("evo/A")], seed=1)
    (tmp_path / "figures").symlink_to("figures")
    with pytest.raises(OSError, match="figures"):
        write_atomically(study.directory / "figures" / "fitness.svg", b"new")


def test_links_inside_a_study_and_explicit_parent_paths_are_followed(tmp_path: Path) -> None:
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


def test_sessions_that_are_a_pipe_are_refused_before_a_run(
    command: Command, tmp_path: Path
) -> None:
    """Opening a pipe for writing waits for a reader."""
    study = make_small_study(tmp_path / "study", [shorten_preset("evo/A")], runs=1)
    sessions = study.directory / "sessions.jsonl"
    sessions.unlink()
    os.mkfifo(sessions)
    done = command("run", str(study.directory), "--runs", "2")
    assert done.code == 2
    assert "sessions.jsonl cannot be written: it is no regular file; remove it" in done.err
    assert len(read_records(study.directory)) == 1
    with pytest.raises(RefusedError, match="it is no regular file"):
        append_line(sessions, "{}", SESSIONS_FILE)


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


AS_USER = """
import os, sys
from baldwinlab.cli import main
import baldwinlab.api.study, baldwinlab.api.report, baldwinlab.api.run_study
if os.getuid() == 0:
    os.setuid(65534)  # root may write into folders that are read-only
sys.argv = ["baldwinlab", *sys.argv[1:]]
main()
"""
SETTINGS = (
    "evolution.generations=3",
    "lifetime.steps=300",
    "world.start.x=400",
    "world.start.y=160",
)
RUN_ONE_MORE = ("run", "evo/A", "--set", *SETTINGS, "--seed", "5", "--runs", "2", "--out", "study")
# Folders that the command reads.
FOLDERS_TO_READ = (Path(baldwinlab.__file__).parent, Path(sys.prefix), Path(sys.base_prefix))


def is_open_to_all(path: Path) -> bool:
    """Return whether all users can access a folder. A command of the root user changes its user."""
    return all(folder.stat().st_mode & stat.S_IXOTH for folder in (path, *path.parents))


needs_other_user = pytest.mark.skipif(
    not hasattr(os, "getuid")
    or (os.getuid() == 0 and not all(map(is_open_to_all, FOLDERS_TO_READ))),
    reason="no user without write permission is available",
)


@pytest.fixture
def folder() -> Iterator[Path]:
    """Return a folder with a read-only study that all users can read."""
    with tempfile.TemporaryDirectory() as name:
        path_of_folder = Path(name)
        make_small_study(path_of_folder / "study", [shorten_preset("evo/A")], runs=1)
        for path in [path_of_folder, *path_of_folder.rglob("*")]:
            path.chmod(0o555 if path.is_dir() else 0o444)
        yield path_of_folder
        for path in [path_of_folder, *path_of_folder.rglob("*")]:
            path.chmod(0o755 if path.is_dir() else 0o644)


def run_as_user(folder: Path, words: Sequence[str]) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", AS_USER, *words]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


@needs_other_user
@pytest.mark.parametrize(
    ("words", "file"),
    [
        (RUN_ONE_MORE, "study/runs/evo/A/0001.nc"),
        pytest.param(
            ("assay", "study", "--assays", "innate"),
            "study/assays/innate/evo/A.nc",
            marks=pytest.mark.nightly,
        ),
        (("report", "study"), "study/claims.json"),
    ],
    ids=["run", "assay", "report"],
)
def test_a_read_only_study_is_refused_before_the_simulation(
    folder: Path, words: tuple[str, ...], file: str
) -> None:
    result = run_as_user(folder, words)
    assert result.returncode == 2
    error = " ".join(result.stderr.split())
    assert f"{file} cannot be written: " in error
    assert "is read-only. Copy the study to a folder that can be written" in error
    assert "the engine" not in result.stdout
    assert ".partial" not in result.stderr


@needs_other_user
def test_a_read_only_study_is_reported_in_another_folder(folder: Path) -> None:
    with tempfile.TemporaryDirectory() as name:
        Path(name).chmod(0o777)
        page = Path(name) / "page.html"
        result = run_as_user(folder, ["report", "study", "--out", str(page)])
        assert result.returncode == 0
        error = " ".join(result.stderr.split())
        assert re.search(r"claims\.json and \d+ other files were not stored in study: ", error)
        assert error.count("baldwinlab: ") == 1
        assert "</html>" in page.read_text("utf-8")


@needs_other_user
@pytest.mark.nightly
def test_stored_runs_of_a_read_only_study_are_read(folder: Path) -> None:
    result = run_as_user(folder, [*RUN_ONE_MORE[:-4], "--runs", "1", "--out", "study"])
    assert (result.returncode, result.stderr) == (0, "")
    assert "stored, none to do" in result.stdout
