"""A command that cannot write into a study fails before the simulation and names the file."""

from __future__ import annotations

import os
import stat
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

import baldwinlab
from tests.small_studies import make_small_study, shorten_preset

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


pytestmark = pytest.mark.skipif(
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


@pytest.mark.nightly
def test_stored_runs_of_a_read_only_study_are_read(folder: Path) -> None:
    result = run_as_user(folder, [*RUN_ONE_MORE[:-4], "--runs", "1", "--out", "study"])
    assert (result.returncode, result.stderr) == (0, "")
    assert "runs are already stored" in result.stdout
