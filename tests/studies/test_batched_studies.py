"""Studies of small runs are stored in batches, with the same guarantees as single files."""

from __future__ import annotations

import os
import random
import signal
from pathlib import Path

import pytest
import xarray as xr

from baldwinlab.core.netcdf import from_bytes
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.backends.choice import CPU
from baldwinlab.simulation import memory
from baldwinlab.simulation.records import make_record
from baldwinlab.simulation.simulate import simulate_histories
from baldwinlab.studies import records, run_task
from baldwinlab.studies.creation import create_study, extend_study
from baldwinlab.studies.executors import THREADS
from baldwinlab.studies.open import open_runs
from baldwinlab.studies.progress import ProgressFile
from baldwinlab.studies.records import DamagedRecordError, StudyError
from baldwinlab.studies.run import find_missing_runs, plan_tasks, run_study
from baldwinlab.studies.store import StudyStore
from tests.small_studies import (
    ignore_message,
    ignore_progress,
    make_small_study,
    read_records,
    shorten_preset,
)
from tests.studies.completion import complete_runs, fail_without_space

CONDITION = "evo/A"
SEED = 5
RUNS = 60

Records = dict[int, xr.Dataset]


def make_experiment(generations: int = 3, steps: int = 40) -> Experiment:
    return shorten_preset(CONDITION).replace(
        evolution={"generations": generations}, lifetime={"steps": steps}
    )


def make_study(directory: Path, runs: int = RUNS, workers: int = 1) -> StudyStore:
    return make_small_study(directory, [make_experiment()], runs, SEED, workers)


def list_names(study: StudyStore) -> list[str]:
    return [file.path.name for file in study.files(CONDITION)]


def make_oracle(generations: int = 3, runs: int = RUNS) -> Records:
    """Simulate the runs without a study."""
    histories = simulate_histories(make_experiment(generations), SEED, range(runs))
    return {history.run: make_record(history) for history in histories}


def require_records(study: StudyStore, expected: Records) -> None:
    assert study.runs(CONDITION) == list(expected)
    for run, record in expected.items():
        xr.testing.assert_identical(study.record(CONDITION, run), record)


@pytest.fixture(scope="module")
def oracle() -> Records:
    return make_oracle()


@pytest.fixture
def small_files(monkeypatch: pytest.MonkeyPatch) -> None:
    """Limit the files to 20 runs."""
    monkeypatch.setattr(memory, "MAX_RUNS_PER_FILE", 20)


@pytest.mark.parametrize("workers", [1, 3])
def test_the_workers_store_their_runs_in_one_file(
    tmp_path: Path, oracle: Records, workers: int
) -> None:
    study = make_study(tmp_path, workers=workers)
    assert list_names(study) == ["0000-0059.nc"]
    require_records(study, oracle)
    assert find_missing_runs(study, RUNS, pytest.fail) == {CONDITION: []}
    assert study.path(CONDITION, 25) in [file.path for file in study.files(CONDITION)]
    assert study.path(CONDITION, RUNS).name == "0060.nc"


@pytest.mark.usefixtures("small_files")
def test_a_study_of_single_files_continues_with_batches(
    tmp_path: Path, oracle: Records, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as earlier:
        earlier.setattr(run_task, "runs_per_file", lambda experiment: 1)
        earlier.setattr(memory, "MAX_RUNS_PER_FILE", 1)
        study = make_study(tmp_path, runs=15)
    single_names = [f"{run:04d}.nc" for run in range(15)]
    assert list_names(study) == single_names
    before = {file.path: file.path.read_bytes() for file in study.files(CONDITION)}
    complete_runs(study, RUNS)
    # The rest of the first block has too few runs for a batch.
    other_names = [f"{run:04d}.nc" for run in range(15, 20)]
    assert list_names(study) == [*single_names, *other_names, "0020-0039.nc", "0040-0059.nc"]
    assert {path: path.read_bytes() for path in before} == before
    require_records(study, oracle)


@pytest.mark.usefixtures("small_files")
@pytest.mark.parametrize("seed", range(12))
def test_a_changed_byte_of_a_batch_is_always_found_and_only_its_runs_are_done_again(
    tmp_path: Path, oracle: Records, seed: int
) -> None:
    study = make_study(tmp_path)
    numbers = random.Random(seed)
    file = numbers.choice(study.files(CONDITION))
    before = {path.name: path.read_bytes() for path in file.path.parent.glob("*.nc")}
    content = bytearray(before[file.path.name])
    # Half of the changes are in the header.
    offset = numbers.randrange(numbers.choice([6000, len(content)]))
    content[offset] ^= 1 << numbers.randrange(8)
    file.path.write_bytes(content)
    with pytest.raises(DamagedRecordError, match=f"{file.path} is damaged"):
        study.record(CONDITION, file.first)
    with pytest.raises(DamagedRecordError, match=f"{file.path} is damaged"):
        open_runs(tmp_path).load()
    messages: list[str] = []
    assert find_missing_runs(study, RUNS, messages.append) == {CONDITION: list(file.runs)}
    (message,) = messages
    assert f"{file.path} is damaged" in message
    assert message.endswith(
        f"it is renamed to {file.path.name}.damaged, and its runs are done again"
    )
    complete_runs(study, RUNS)
    assert {path.name: path.read_bytes() for path in file.path.parent.glob("*.nc")} == before
    require_records(study, oracle)


def test_a_batch_of_other_runs_is_damaged_and_other_runs_are_not_stored(tmp_path: Path) -> None:
    study = make_study(tmp_path, runs=20)
    with pytest.raises(StudyError, match=r"0020\.nc does not exist; runs .* stored: 20"):
        study.record(CONDITION, 20)
    (file,) = study.files(CONDITION)
    misplaced = file.path.rename(file.path.with_name("0100-0119.nc"))
    with pytest.raises(
        DamagedRecordError,
        match="it is runs 0 to 19 of evo/A with seed 5, and runs 100 to 119 of evo/A with seed 5 "
        "belong there",
    ):
        study.record(CONDITION, 105)
    messages: list[str] = []
    assert find_missing_runs(study, 20, messages.append) == {CONDITION: list(range(20))}
    assert messages[0].endswith(
        f"it is renamed to {misplaced.name}.damaged, and its runs are not done again, "
        "as --runs is 20"
    )


@pytest.mark.parametrize(
    ("earlier_workers", "workers"),
    [
        *((1, 3), (3, 1)),
        *(pytest.param(n, n, marks=pytest.mark.nightly) for n in (1, 3)),
    ],
)
def test_an_extended_study_has_the_records_of_a_long_one(
    tmp_path: Path, earlier_workers: int, workers: int
) -> None:
    study = extend_study(make_study(tmp_path, workers=earlier_workers), 5)
    missing = find_missing_runs(study, RUNS, pytest.fail)
    assert missing == {CONDITION: list(range(RUNS))}
    run_study(study, missing, workers, ignore_progress, ignore_message)
    assert find_missing_runs(study, RUNS, pytest.fail) == {CONDITION: []}
    require_records(study, make_oracle(generations=5))
    # A file whose runs are all in narrower files is removed by the next session.
    study.sweep()
    assert sum(len(file.runs) for file in study.files(CONDITION)) == RUNS
    require_records(study, make_oracle(generations=5))


@pytest.mark.parametrize(
    "seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.nightly) for seed in range(2, 6))]
)
def test_an_interrupted_task_stores_its_finished_runs(
    tmp_path: Path, oracle: Records, seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The task has several batches.
    monkeypatch.setattr(memory, "MAX_AGENTS_PER_WORLD", 3)
    study = create_study(tmp_path, [make_experiment()], SEED)
    batch_runs = memory.count_batch_runs(make_experiment(), CPU.worlds)
    assert 1 < batch_runs < RUNS // 2
    n_generations = random.Random(seed).randrange(1, 3 * RUNS // batch_runs)
    tasks = plan_tasks(study, {CONDITION: list(range(RUNS))}, 1, is_one_process=False)
    steps = THREADS.run(study, tasks, 1, CPU)
    for _ in range(n_generations):
        next(steps)
    steps.close()
    stored = study.runs(CONDITION)
    assert len(stored) >= n_generations // 3 * batch_runs
    require_records(study, {run: oracle[run] for run in stored})
    complete_runs(study, RUNS)
    require_records(study, oracle)


@pytest.mark.parametrize("seed", range(4))
def test_a_write_that_fails_at_any_file_leaves_valid_files(
    tmp_path: Path, oracle: Records, seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(memory, "MAX_RUNS_PER_FILE", 20)
    study = create_study(tmp_path, [make_experiment()], SEED)
    n_written = seed

    def fail_later(handle: int) -> None:
        nonlocal n_written
        n_written -= 1
        if n_written < 0:
            fail_without_space(handle)

    with monkeypatch.context() as full_disk:
        full_disk.setattr(os, "fsync", fail_later)
        full_disk.setattr(ProgressFile, "_write", ignore_message)
        if seed < 3:
            with pytest.raises(OSError, match="no space is left"):
                complete_runs(study, RUNS)
        else:
            complete_runs(study, RUNS)
    assert not list(tmp_path.rglob("*.partial"))
    assert len(study.runs(CONDITION)) == 20 * seed
    require_records(study, {run: oracle[run] for run in range(20 * seed)})
    complete_runs(study, RUNS)
    require_records(study, oracle)


def test_a_process_that_is_killed_in_the_middle_of_a_write_leaves_no_part_of_a_batch(
    tmp_path: Path, oracle: Records, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = create_study(tmp_path, [make_experiment()], SEED)
    child = os.fork()
    if child == 0:
        # The content is written, and the file still has its temporary name.
        monkeypatch.setattr(ProgressFile, "_write", ignore_message)
        monkeypatch.setattr(os, "fsync", lambda handle: os.kill(os.getpid(), signal.SIGKILL))
        complete_runs(study, RUNS)
    _, status = os.waitpid(child, 0)
    assert os.WTERMSIG(status) == signal.SIGKILL
    assert list(tmp_path.rglob(".0000-0059.nc.*.partial"))
    assert study.runs(CONDITION) == []
    complete_runs(study, RUNS)
    require_records(study, oracle)
    assert list_names(study) == ["0000-0059.nc"]
    assert not list(tmp_path.rglob("*.partial"))


def test_the_runs_of_a_batch_are_decoded_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = make_study(tmp_path)
    n_decoded = 0

    def count(raw: bytes) -> xr.Dataset:
        nonlocal n_decoded
        n_decoded += 1
        return from_bytes(raw)

    monkeypatch.setattr(records, "from_bytes", count)
    first = study.record(CONDITION, 0)
    first["energy"][:] = 0
    assert study.record(CONDITION, 0)["energy"].any(), "a caller can change its record"
    for run in study.runs(CONDITION):
        study.record(CONDITION, run)
    assert n_decoded == 1


@pytest.mark.parametrize("workers", [2, 3, 5, 8])
def test_the_files_do_not_depend_on_the_number_of_workers(
    tmp_path: Path, workers: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(memory, "MAX_RUNS_PER_FILE", 17)
    expected = make_study(tmp_path / "1", workers=1)
    study = make_study(tmp_path / str(workers), workers=workers)
    assert len(list_names(study)) < RUNS
    assert read_records(study.directory) == read_records(expected.directory)


def test_a_task_of_another_process_has_all_runs_of_its_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(memory, "MAX_RUNS_PER_FILE", 17)
    study = create_study(tmp_path, [make_experiment()], SEED)
    runs = list(range(100))
    tasks = plan_tasks(study, {CONDITION: runs}, 8, is_one_process=False)
    assert sorted(run for task in tasks for run in task.runs) == runs
    blocks = [{run // 17 for run in task.runs} for task in tasks]
    assert sum(map(len, blocks)) == len(set().union(*blocks)) == 6


def test_an_interrupted_study_stores_the_finished_runs_of_tasks_that_share_a_file(
    tmp_path: Path, oracle: Records
) -> None:
    study = create_study(tmp_path, [make_experiment()], SEED)
    n_runs_done = 0

    def interrupt(run: xr.Dataset) -> None:
        nonlocal n_runs_done
        n_runs_done += run.sizes["generation"] == 3
        if n_runs_done == 16:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_study(
            study, {CONDITION: [*range(RUNS)]}, 5, ignore_progress, ignore_message,
            callback=interrupt,
        )  # fmt: skip
    stored = study.runs(CONDITION)
    assert 0 < len(stored) < RUNS
    require_records(study, {run: oracle[run] for run in stored})
    complete_runs(study, RUNS)
    require_records(study, oracle)
