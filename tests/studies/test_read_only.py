"""A command that cannot write into a study says so, naming the file, before it computes anything."""

from __future__ import annotations

import os
import stat
import subprocess
import sys
import tempfile
from collections.abc import Iterator
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
MORE = ("run", "evo/A", "--set", *SETTINGS, "--seed", "5", "--runs", "2", "--out", "study")


READ = (Path(baldwinlab.__file__).parent, Path(sys.prefix), Path(sys.base_prefix))  # by the command


def is_open_to_all(path: Path) -> bool:
    """Whether another user reaches a folder, as the command does that is started by root."""
    return all(each.stat().st_mode & stat.S_IXOTH for each in (path, *path.parents))


pytestmark = pytest.mark.skipif(
    not hasattr(os, "getuid") or (os.getuid() == 0 and not all(map(is_open_to_all, READ))),
    reason="there is no user here for whom a folder is read-only",
)


@pytest.fixture
def folder() -> Iterator[Path]:
    """A folder with a read-only study, which another user can read."""
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        make_small_study(place / "study", [shorten_preset("evo/A")], runs=1)
        for path in [place, *place.rglob("*")]:
            path.chmod(0o555 if path.is_dir() else 0o444)
        yield place
        for path in [place, *place.rglob("*")]:
            path.chmod(0o755 if path.is_dir() else 0o644)


@pytest.mark.parametrize(
    ("words", "file"),
    [
        (MORE, "study/runs/evo/A/0001.nc"),
        (("assay", "study", "--assays", "innate"), "study/assays/innate/evo/A.nc"),
        (("report", "study"), "study/claims.json"),
    ],
    ids=["run", "assay", "report"],
)
def test_a_read_only_study_is_told_before_anything_is_computed(
    folder: Path, words: tuple[str, ...], file: str
) -> None:
    done = subprocess.run(
        [sys.executable, "-c", AS_USER, *words],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert f"{file} cannot be written: " in " ".join(done.stderr.split())
    assert "is read-only. Copy the study to a folder that can be written" in " ".join(
        done.stderr.split()
    )
    assert "the engine" not in done.stdout and ".partial" not in done.stderr


def test_what_is_stored_is_read_from_a_read_only_study(folder: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", AS_USER, *MORE[:-4], "--runs", "1", "--out", "study"],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert "runs are already stored" in done.stdout
