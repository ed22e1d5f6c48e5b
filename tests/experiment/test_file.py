"""Data files of parts: results depend on their content, so a study stores their hash."""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.experiment import Experiment, ExperimentError, assign, look_up, registry
from baldwinlab.experiment.toml import from_toml, to_toml
from baldwinlab.parts import File, PartError, load_file
from baldwinlab.studies.store import StudyStore
from tests.commands import Command
from tests.small_studies import shorten_preset

PART = Path(__file__).parents[2] / "examples" / "parts" / "tabled_fitness.py"
FIELD = "evolution.tabled.table"
SHORT = (
    "--set",
    "evolution.generations=2",
    "lifetime.steps=20",
    "evolution.fitness=tabled",
    f"{FIELD}=worth.txt",
)
RUN = ("run", "evo/A", "--part", str(PART), *SHORT, "--out", "study")


@pytest.fixture(autouse=True)
def table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Return the file worth.txt in the working directory, and load the part that reads it."""
    monkeypatch.chdir(tmp_path)
    load_file(PART)
    path = tmp_path / "worth.txt"
    path.write_bytes(b"5\n6\n7\n")
    yield path
    registry.remove("fitness", "tabled")


def make_experiment_with_table() -> Experiment:
    short = shorten_preset("evo/A").replace(lifetime={"steps": 20}, evolution={"generations": 2})
    experiment: Experiment = assign(short, ["evolution.fitness=tabled", f"{FIELD}=worth.txt"])
    return experiment


def sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def test_an_experiment_contains_the_hash_of_its_data_file(table: Path) -> None:
    experiment = make_experiment_with_table()
    assert look_up(experiment, FIELD)[0] == File(path="worth.txt", sha256=sha256(table))
    assert from_toml(to_toml(experiment), source="again") == experiment
    table.write_bytes(b"1\n")
    assert make_experiment_with_table() != experiment


@pytest.mark.usefixtures("in_plain_python")
def test_a_part_reads_the_current_content_of_its_file(table: Path) -> None:
    first = bl.simulate(make_experiment_with_table(), seed=1)
    assert set(np.unique(first.energy)) <= {5.0, 6.0, 7.0}
    table.write_bytes(b"50\n60\n")
    second = bl.simulate(make_experiment_with_table(), seed=1)
    assert set(np.unique(second.energy)) <= {50.0, 60.0}


def test_a_changed_file_is_refused_when_it_is_read(table: Path) -> None:
    file = look_up(make_experiment_with_table(), FIELD)[0]
    before = sha256(table)
    table.write_bytes(b"1\n")
    with pytest.raises(
        PartError, match=f"worth.txt has the SHA-256 {sha256(table)[:12]}..., .* {before[:12]}"
    ):
        file.read()


def test_a_study_can_be_resumed_only_with_the_same_file(command: Command, table: Path) -> None:
    """A study without its file can be read but not resumed."""
    assert command(*RUN, "--runs", "1").code == 0
    before = sha256(table)
    content = table.read_bytes()
    table.write_bytes(b"1\n")
    for words in (
        (*RUN, "--runs", "2"),
        ("assay", "study", "--part", str(PART), "--assays", "innate"),
    ):
        outcome = command(*words)
        assert outcome.code == 2
        assert re.search(
            rf"{FIELD} of evo/A in study: the file worth.txt has the SHA-256 "
            rf"{sha256(table)[:12]}\.\.\., "
            rf"and the experiment was made with a file with {before[:12]}",
            " ".join(outcome.err.split()),
        )
    assert StudyStore(Path("study")).runs("evo/A") == [0]
    table.unlink()
    outcome = command(*RUN, "--runs", "2")
    assert outcome.code == 2
    assert f"{FIELD} = 'worth.txt': the file worth.txt cannot be read: No such file" in outcome.err
    assert bl.open_runs("study").sizes["run"] == 1
    table.write_bytes(content)
    assert command(*RUN, "--runs", "2").code == 0
    assert StudyStore(Path("study")).runs("evo/A") == [0, 1]


def test_a_stored_experiment_does_not_run_with_a_different_file(
    command: Command, table: Path
) -> None:
    assert command(*RUN, "--runs", "1").code == 0
    table.write_bytes(b"1\n")
    stored = "study/runs/evo/A/experiment.toml"
    outcome = command("run", stored, "--part", str(PART), "--runs", "1", "--out", "new")
    assert outcome.code == 2
    assert f"{FIELD} of evo/A: the file worth.txt has the SHA-256" in outcome.err
    assert not Path("new").exists()


@pytest.mark.parametrize("kind", ["missing", "pipe", "folder", "huge"])
def test_an_unreadable_file_is_refused_with_the_field(table: Path, kind: str) -> None:
    if kind != "huge":
        table.unlink()
    if kind == "pipe":
        os.mkfifo(table)
    elif kind == "folder":
        table.mkdir()
    elif kind == "huge":
        os.truncate(table, 20 * 10**9)
    with pytest.raises(
        ExperimentError, match=f"{FIELD} = 'worth.txt': the file worth.txt cannot be read: "
    ):
        make_experiment_with_table()
