"""The command `status`."""

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
    """A study with one file per run."""
    directory = tmp_path_factory.mktemp("stored") / "study"
    with pytest.MonkeyPatch.context() as earlier:
        earlier.setattr(memory, "MAX_RUNS_PER_FILE", 1)
        make_study(directory, runs=RUNS)
    return directory


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
