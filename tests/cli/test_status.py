"""The commands `status` and `migrate`."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from baldwinlab.simulation import memory
from tests.commands import Command
from tests.studies.test_batched_studies import CONDITION, make_study

RUNS = 20


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study of version 0.1: each run has a file."""
    directory = tmp_path_factory.mktemp("stored") / "study"
    with pytest.MonkeyPatch.context() as earlier:
        earlier.setattr(memory, "MAX_RUNS_PER_FILE", 1)
        make_study(directory, runs=RUNS)
    return directory


def list_names(directory: Path) -> list[str]:
    return sorted(path.name for path in directory.rglob("*.nc"))


def test_status_shows_stored_and_missing_runs_and_failures(
    command: Command, stored: Path, tmp_path: Path
) -> None:
    directory = shutil.copytree(stored, tmp_path / "study")
    path = directory / "runs" / CONDITION / "0003.nc"
    path.rename(f"{path}.damaged")
    result = command("status", "study")
    assert result.code == 0
    assert "study: 19 of 20 runs stored" in result.out
    assert f"{CONDITION}: 19 stored, 1 missing" in result.out
    assert "not running; the last session had" in result.out
    assert "0003.nc.damaged was damaged" in result.err
    content = json.loads(command("status", "study", "--json").out)
    assert (content["done"], content["missing"]) == (19, 1)
    assert content["is_running"] is False
    assert content["seconds_left"] > 0
    assert len(content["failures"]) == 1


def test_migrate_reports_and_merges_the_files(
    command: Command, stored: Path, tmp_path: Path
) -> None:
    directory = shutil.copytree(stored, tmp_path / "study")
    before = list_names(directory)
    result = command("migrate", "study", "--dry-run")
    assert "20 files of single runs would be merged into 1 files" in result.out
    assert list_names(directory) == before
    assert "20 files of single runs merged into 1 files" in command("migrate", "study").out
    assert list_names(directory) == ["0000-0019.nc"]
    assert "all 20 runs are already stored" in command("run", "study", "--runs", "20").out


@pytest.mark.parametrize("name", ["status", "migrate"])
def test_a_folder_without_a_study_is_refused(command: Command, name: str) -> None:
    result = command(name, "nothing")
    assert result.code == 2
    assert "nothing holds no study" in result.err
