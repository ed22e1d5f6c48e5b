"""Data files of parts: results depend on their content, so a study stores their hash."""

from __future__ import annotations

import hashlib
import os
import pickle
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


def forget_files(monkeypatch: pytest.MonkeyPatch) -> None:
    """Forget which files this process has seen, as another process does not know them."""
    monkeypatch.setattr("baldwinlab.experiment.file._PATHS", {})


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
    table.write_bytes(b"1\n")
    with pytest.raises(PartError, match=r"the file worth\.txt has changed"):
        file.read()


def test_a_study_keeps_its_copy_of_a_file(
    command: Command, table: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The command that made the study needs the file again, and continuing the study does not."""
    assert command(*RUN, "--runs", "1").code == 0
    table.write_bytes(b"1\n")
    outcome = command(*RUN, "--runs", "2")
    assert outcome.code == 2
    assert (
        f"study holds another study: the data file of {FIELD} of evo/A has other content; "
        "choose another --out"
    ) in " ".join(outcome.err.split())
    assert StudyStore(Path("study")).runs("evo/A") == [0]
    table.unlink()
    outcome = command(*RUN, "--runs", "2")
    assert outcome.code == 2
    assert f"{FIELD} = 'worth.txt': the file worth.txt cannot be read: No such file" in outcome.err
    Path("study").rename("moved")
    forget_files(monkeypatch)
    assert command("run", "moved", "--part", str(PART), "--runs", "2").code == 0
    assert command("assay", "moved", "--part", str(PART), "--assays", "innate").code == 0
    assert StudyStore(Path("moved")).runs("evo/A") == [0, 1]


@pytest.mark.parametrize("location", ["worth.txt", "./worth.txt", "{folder}/worth.txt", "a b/c=d"])
@pytest.mark.parametrize("content", [b"5\n6\n7\n", b"\xef\xbb\xbf5\r\n6\r\n7\r\n", b"5\r6\r7\r"])
def test_the_same_content_is_the_same_study(
    command: Command, table: Path, location: str, content: bytes
) -> None:
    assert command(*RUN, "--runs", "1").code == 0
    copy = Path(location.format(folder=table.parent))
    copy.parent.mkdir(exist_ok=True)
    copy.write_bytes(content)
    words = [word.replace("worth.txt", str(copy)) for word in RUN]
    outcome = command(*words, "--runs", "1")
    assert (outcome.code, outcome.err) == (0, "")
    assert "1 run stored, none to do" in outcome.out


@pytest.mark.usefixtures("in_plain_python")
def test_line_endings_and_a_byte_order_mark_change_no_result(table: Path) -> None:
    energy = bl.simulate(make_experiment_with_table(), seed=1).energy
    table.write_bytes(b"\xef\xbb\xbf5\r\n6\r\n7\r\n")
    np.testing.assert_array_equal(bl.simulate(make_experiment_with_table(), seed=1).energy, energy)


def test_a_binary_file_is_not_changed(tmp_path: Path) -> None:
    for name, content in {"nul": b"\xef\xbb\xbf\0\r\n", "latin": b"\xe4\r\n"}.items():
        (tmp_path / name).write_bytes(content)
        file = File(path=name)
        assert file.sha256 == sha256(tmp_path / name)
        assert file.read() == content


def test_a_file_is_found_from_another_working_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    experiment = make_experiment_with_table()
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert look_up(experiment, FIELD)[0].read() == b"5\n6\n7\n"


def test_another_process_finds_the_file_of_a_pickled_experiment(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    content = pickle.dumps(make_experiment_with_table())
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    forget_files(monkeypatch)
    assert look_up(pickle.loads(content), FIELD)[0].read() == b"5\n6\n7\n"


def test_a_stored_experiment_runs_with_the_copy_of_its_study(
    command: Command, table: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert command(*RUN, "--runs", "1").code == 0
    table.write_bytes(b"1\n")
    forget_files(monkeypatch)
    stored = "study/runs/evo/A/experiment.toml"
    outcome = command("run", stored, "--part", str(PART), "--runs", "1", "--out", "new")
    assert outcome.code == 0, outcome.err
    records = [Path(folder, "runs/evo/A/0000.nc").read_bytes() for folder in ("study", "new")]
    assert records[0] == records[1]


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


def test_a_study_keeps_a_copy_of_a_scheduled_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "later.txt").write_bytes(b"50\n60\n70\n")
    scheduled = make_experiment_with_table().replace(
        schedule=[{"generation": 1, FIELD: "later.txt"}]
    )
    assert from_toml(to_toml(scheduled), source="again") == scheduled
    bl.run(scheduled, runs=1, out="study")
    (tmp_path / "later.txt").unlink()
    (tmp_path / "worth.txt").unlink()
    forget_files(monkeypatch)
    study = bl.open_study("study")
    study.extend(3, runs=2)
    assert study.data().energy.isel(generation=0).max() <= 7
    assert study.data().energy.isel(generation=slice(1, None)).min() >= 50
