"""Faults of studies in batches: nothing stored is lost, and nothing wrong is accepted."""

from __future__ import annotations

import multiprocessing
import os
import random
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from multiprocessing.process import BaseProcess
from pathlib import Path

import pytest
import xarray as xr

from baldwinlab.simulation import memory
from baldwinlab.studies.creation import create_study
from baldwinlab.studies.open import open_runs
from baldwinlab.studies.run import find_missing_runs
from baldwinlab.studies.store import StudyStore
from tests.faults import amount
from tests.faults.test_corruptions import damage
from tests.small_studies import shorten_preset
from tests.studies.completion import complete_runs

CONDITION = "evo/A"
SEED = 5
RUNS = 400
RUNS_PER_FILE = 20
EXPERIMENT = shorten_preset(CONDITION).replace(
    evolution={"generations": 2}, lifetime={"steps": 100}
)
# A forked process needs no time for imports and compilation.
FORKED = multiprocessing.get_context("fork")


def complete_in_files(study: StudyStore, runs_per_file: int) -> None:
    memory.MAX_RUNS_PER_FILE = runs_per_file  # type: ignore[misc]
    complete_runs(study, RUNS)


def start(study: StudyStore, runs_per_file: int = RUNS_PER_FILE) -> BaseProcess:
    process = FORKED.Process(target=complete_in_files, args=(study, runs_per_file))
    process.start()
    return process


def read_files(study: StudyStore) -> dict[str, bytes]:
    return {file.path.name: file.path.read_bytes() for file in study.files(CONDITION)}


def require_values(study: StudyStore, expected: xr.Dataset) -> None:
    """Require that the stored runs have their values, and that all others are missing."""
    stored = study.runs(CONDITION)
    missing = find_missing_runs(study, RUNS, pytest.fail)
    assert missing == {CONDITION: sorted({*range(RUNS)}.difference(stored))}
    if stored:
        xr.testing.assert_identical(open_runs(study.directory).load(), expected.sel(run=stored))


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished study."""
    directory = tmp_path_factory.mktemp("finished") / "study"
    with pytest.MonkeyPatch.context() as small_files:
        small_files.setattr(memory, "MAX_RUNS_PER_FILE", RUNS_PER_FILE)
        complete_runs(create_study(directory, [EXPERIMENT], SEED), RUNS)
    return directory


@pytest.fixture(scope="module")
def expected(finished: Path) -> xr.Dataset:
    return open_runs(finished).load()


@pytest.fixture
def study(finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> StudyStore:
    """A copy of the finished study."""
    monkeypatch.setattr(memory, "MAX_RUNS_PER_FILE", RUNS_PER_FILE)
    return StudyStore(shutil.copytree(finished, tmp_path / "study"))


def test_kills_at_any_time_lose_no_stored_batch(tmp_path: Path, expected: xr.Dataset) -> None:
    numbers = random.Random(SEED)
    n_kills = amount(100, 4)
    n_studies = n_batches = 0
    study = create_study(tmp_path / "0", [EXPERIMENT], SEED)
    while n_kills:
        before = read_files(study)
        process = start(study)
        n_new = numbers.randrange(4)
        while process.is_alive() and len(study.files(CONDITION)) < len(before) + n_new:
            time.sleep(0.001)
        time.sleep(numbers.uniform(0, 0.05))
        if process.is_alive():
            process.kill()
            n_kills -= 1
        process.join()
        after = read_files(study)
        assert before.items() <= after.items(), "a stored batch is lost"
        n_batches += len(after) - len(before)
        require_values(study, expected)
        if len(study.runs(CONDITION)) == RUNS:
            n_studies += 1
            study = create_study(tmp_path / str(n_studies), [EXPERIMENT], SEED)
    complete_runs(study, RUNS)
    require_values(study, expected)
    assert n_batches > 0


def test_damaged_files_are_named_and_their_runs_are_done_again(study: StudyStore) -> None:
    before = read_files(study)
    numbers = random.Random(SEED)
    for _ in range(amount(40, 5)):
        file = numbers.choice(study.files(CONDITION))
        content = before[file.path.name]
        damaged = damage(content, numbers)
        while damaged == content:
            damaged = damage(content, numbers)
        file.path.write_bytes(damaged)
        messages: list[str] = []
        complete_runs(study, RUNS, log=messages.append)
        (message,) = messages
        assert f"{file.path} is damaged" in message or f"{file.path} cannot be" in message
        assert message.endswith("and its runs are done again")
        assert read_files(study) == before


def test_processes_that_run_the_same_study_store_each_run(
    tmp_path: Path, expected: xr.Dataset
) -> None:
    numbers = random.Random(SEED)
    for index in range(amount(10, 1)):
        study = create_study(tmp_path / str(index), [EXPERIMENT], SEED)
        processes = [start(study, runs_per_file) for runs_per_file in (20, 33)]
        if index % 2:
            time.sleep(numbers.uniform(0, 0.2))
            processes[0].kill()
        for process in processes:
            process.join()
        assert processes[1].exitcode == 0
        assert len(study.runs(CONDITION)) == RUNS
        require_values(study, expected)


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of 256 KiB: about a third of the study."""
    command = ["mount", "-t", "tmpfs", "-o", "size=256k", "tmpfs", str(tmp_path)]
    if not shutil.which("mount") or subprocess.run(command, check=False).returncode:
        pytest.skip("only the root user can mount a small disk")
    yield tmp_path
    subprocess.run(["umount", str(tmp_path)], check=True)


def test_a_full_disk_keeps_the_stored_batches(
    small_disk: Path, expected: xr.Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(memory, "MAX_RUNS_PER_FILE", RUNS_PER_FILE)
    study = create_study(small_disk / "study", [EXPERIMENT], SEED)
    with pytest.raises(OSError, match="no space is left"):
        complete_runs(study, RUNS)
    stored = study.runs(CONDITION)
    assert 0 < len(stored) < RUNS
    assert not list(small_disk.rglob("*.partial"))
    require_values(study, expected)
    subprocess.run(["mount", "-o", "remount,size=8m", str(small_disk)], check=True)
    complete_runs(study, RUNS)
    require_values(study, expected)
    assert study.runs(CONDITION)[: len(stored)] == stored


@pytest.mark.skipif(
    not hasattr(os, "getuid") or os.getuid() != 0, reason="only the root user can change its user"
)
def test_a_read_only_study_keeps_its_files(finished: Path) -> None:
    # Other users cannot enter the folder of a test.
    with tempfile.TemporaryDirectory() as name:
        directory = Path(name) / "study"
        shutil.copytree(finished, directory)
        study = StudyStore(directory)
        study.files(CONDITION)[0].path.unlink()
        before = read_files(study)
        for path in [Path(name), *Path(name).rglob("*")]:
            path.chmod(0o555 if path.is_dir() else 0o444)
        process = FORKED.Process(target=complete_as_other_user, args=(study,))
        process.start()
        process.join()
        assert process.exitcode == 0
        assert read_files(study) == before
        assert find_missing_runs(study, RUNS, pytest.fail) == {CONDITION: list(range(20))}


def complete_as_other_user(study: StudyStore) -> None:
    """Require that the missing runs cannot be stored."""
    os.setuid(65534)
    with pytest.raises(OSError, match=r"ermission denied|read-only"):
        complete_runs(study, RUNS)
    open_runs(study.directory).load()
