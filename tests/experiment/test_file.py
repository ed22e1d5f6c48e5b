"""A data file of a part decides results, so a study is bound to its content."""

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
    """The file worth.txt in the working directory, with the part that reads it."""
    monkeypatch.chdir(tmp_path)
    load_file(PART)
    path = tmp_path / "worth.txt"
    path.write_bytes(b"5\n6\n7\n")
    yield path
    registry.remove("fitness", "tabled")


def tabled() -> Experiment:
    short = shorten_preset("evo/A").replace(lifetime={"steps": 20}, evolution={"generations": 2})
    made: Experiment = assign(short, ["evolution.fitness=tabled", f"{FIELD}=worth.txt"])
    return made


def digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def test_the_hash_of_the_content_is_a_part_of_the_experiment(table: Path) -> None:
    one = tabled()
    assert look_up(one, FIELD)[0] == File(path="worth.txt", sha256=digest(table))
    assert from_toml(to_toml(one), where="again") == one
    table.write_bytes(b"1\n")
    assert tabled() != one


@pytest.mark.usefixtures("in_plain_python")
def test_a_part_reads_what_the_file_holds_and_never_an_older_content(table: Path) -> None:
    first = bl.simulate(tabled(), seed=1)
    assert set(np.unique(first.energy)) <= {5.0, 6.0, 7.0}
    table.write_bytes(b"50\n60\n")
    second = bl.simulate(tabled(), seed=1)
    assert set(np.unique(second.energy)) <= {50.0, 60.0}


def test_a_changed_file_is_refused_where_it_is_read(table: Path) -> None:
    given = look_up(tabled(), FIELD)[0]
    before = digest(table)
    table.write_bytes(b"1\n")
    with pytest.raises(
        PartError, match=f"worth.txt has the SHA-256 {digest(table)[:12]}..., .* {before[:12]}"
    ):
        given.read()


def test_a_study_is_resumed_with_the_same_file_only(command: Command, table: Path) -> None:
    """Also where it is read without being run, which needs no file."""
    assert command(*RUN, "--runs", "1").code == 0
    before, whole = digest(table), table.read_bytes()
    table.write_bytes(b"1\n")
    for words in (
        (*RUN, "--runs", "2"),
        ("assay", "study", "--part", str(PART), "--assays", "innate"),
    ):
        done = command(*words)
        assert done.code == 2
        assert re.search(
            rf"{FIELD} of evo/A in study: the file worth.txt has the SHA-256 {digest(table)[:12]}\.\.\., "
            rf"and the experiment was made with a file with {before[:12]}",
            " ".join(done.err.split()),
        )
    assert StudyStore(Path("study")).runs("evo/A") == [0]
    table.unlink()
    done = command(*RUN, "--runs", "2")
    assert (
        done.code == 2
        and f"{FIELD} = 'worth.txt': the file worth.txt cannot be read: No such file" in done.err
    )
    assert bl.open_runs("study").sizes["run"] == 1
    table.write_bytes(whole)
    assert command(*RUN, "--runs", "2").code == 0
    assert StudyStore(Path("study")).runs("evo/A") == [0, 1]


def test_a_stored_experiment_is_not_run_elsewhere_with_another_file(
    command: Command, table: Path
) -> None:
    assert command(*RUN, "--runs", "1").code == 0
    table.write_bytes(b"1\n")
    stored = "study/runs/evo/A/experiment.toml"
    done = command("run", stored, "--part", str(PART), "--runs", "1", "--out", "new")
    assert done.code == 2 and f"{FIELD} of evo/A: the file worth.txt has the SHA-256" in done.err
    assert not Path("new").exists()


@pytest.mark.parametrize("kind", ["missing", "pipe", "folder", "huge"])
def test_what_is_no_readable_file_is_refused_with_the_field(table: Path, kind: str) -> None:
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
        tabled()
