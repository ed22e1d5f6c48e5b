"""A task stores its runs in batches as in single files, and continues the work of an attempt."""

from __future__ import annotations

import random
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import baldwinlab as bl
from baldwinlab.core.netcdf import from_bytes, to_bytes
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.backends.choice import CPU
from baldwinlab.simulation import memory
from baldwinlab.simulation.history import History
from baldwinlab.simulation.records import encode_history, make_batch, make_record
from baldwinlab.simulation.simulate import simulate_histories
from baldwinlab.studies import run_task
from baldwinlab.studies.checkpoints import Interval, checkpoint_path
from baldwinlab.studies.creation import create_study
from baldwinlab.studies.executors import StoppedError
from baldwinlab.studies.records import encode_record
from baldwinlab.studies.run_task import RecordWriter, RunTask
from baldwinlab.studies.store import StudyStore
from tests.small_studies import make_small_study, read_records, shorten_preset

SEED = 3
RUNS = 24


def make_experiment(name: str = "evo/A", **changes: Any) -> Experiment:
    settings = {"evolution": {"generations": 6}, "lifetime": {"steps": 100}}
    return bl.load(name).replace(**{**settings, **changes})


EXPERIMENTS: dict[str, Experiment] = {
    "small": make_experiment(),
    "few stored genomes": make_experiment(record={"genome_every": 4}),
    "time series": make_experiment(record={"every": 30}),
    "novelty archive": make_experiment(evolution={"generations": 6, "fitness": "novelty"}),
    "stopped runs": bl.load("evo/A").replace(
        evolution={
            "generations": 8,
            "stop": "target-fitness",
            "target_fitness": {"target": 8.5},
        },
        lifetime={"steps": 300},
        record={"genome_every": 5},
        world={"start": {"x": 400, "y": 160}},
    ),
    "NEAT": bl.load("stanley-miikkulainen-2002:neat").replace(evolution={"generations": 6}),
    "births during a lifetime": bl.load("evo+reward/births-and-deaths").replace(
        evolution={"generations": 3}, lifetime={"steps": 300}
    ),
    "species": make_experiment(
        population={
            "size": 8,
            "species": [{"name": "prey", "size": 5}, {"name": "other", "size": 3}],
        }
    ),
}
DAILY_EXPERIMENTS = ("small", "stopped runs", "NEAT", "births during a lifetime")


def store(study: StudyStore, histories: Sequence[History]) -> None:
    (experiment,) = study.experiments.values()
    runs = [history.run for history in histories]
    writer = RecordWriter(study.directory, experiment, runs)
    for history in histories:
        writer.add(history, has_checkpoint=False)
    writer.flush()


def require_equal(record: xr.Dataset, expected: xr.Dataset) -> None:
    assert record.identical(expected)
    assert list(record.attrs) == list(expected.attrs)
    # A netCDF file has the variables in the order of their shapes. A continued run has equal bytes
    # if variables with equal shapes have the same order.
    assert list_by_shape(record) == list_by_shape(expected)
    for name, variable in expected.variables.items():
        assert record.variables[name].dtype == variable.dtype


def list_by_shape(record: xr.Dataset) -> list[str]:
    return [str(name) for name in sorted(record.data_vars, key=lambda name: record[name].shape)]


def list_names(study: StudyStore) -> list[str]:
    (condition,) = study.experiments
    return [file.path.name for file in study.files(condition)]


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.nightly] * (name not in DAILY_EXPERIMENTS))
        for name in EXPERIMENTS
    ],
)
def test_the_records_of_a_batch_equal_the_files_of_single_runs(tmp_path: Path, name: str) -> None:
    experiment = EXPERIMENTS[name]
    study = create_study(tmp_path, [experiment], SEED)
    histories = simulate_histories(experiment, SEED, range(RUNS))
    store(study, histories)
    assert list_names(study) == ["0000-0023.nc"]
    assert study.runs(experiment.name) == list(range(RUNS))
    for history in histories:
        expected = from_bytes(encode_record(make_record(history)))
        record = study.record(experiment.name, history.run)
        require_equal(record, expected)
        assert study.attributes(experiment.name, history.run) == record.attrs
        assert encode_history(history) == encode_record(make_record(history))
    batch = make_batch(histories)
    assert batch.encode() == to_bytes(batch.to_dataset())
    (file,) = study.files(experiment.name)
    lengths = study.lengths(experiment.name, file)
    assert lengths.n_generations.tolist() == [history.n_generations for history in histories]
    assert lengths.is_stopped.tolist() == [history.is_stopped for history in histories]
    if name == "stopped runs":
        assert len(set(lengths.n_generations)) > 2
        assert 0 < lengths.is_stopped.sum() < RUNS


@pytest.mark.parametrize(
    "seed", [0, 1, 2, *(pytest.param(seed, marks=pytest.mark.nightly) for seed in range(3, 8))]
)
def test_any_partition_of_the_runs_gives_the_same_records(
    tmp_path: Path, seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run_task, "MIN_RUNS_PER_BATCH", 2)
    experiment = EXPERIMENTS["stopped runs"]
    study = create_study(tmp_path, [experiment], SEED)
    numbers = random.Random(seed)
    runs = sorted(numbers.sample(range(40), RUNS))
    histories = {history.run: history for history in simulate_histories(experiment, SEED, runs)}
    unstored = list(runs)
    numbers.shuffle(unstored)
    while unstored:
        size = numbers.randint(1, len(unstored))
        store(study, [histories[run] for run in unstored[:size]])
        del unstored[:size]
    assert study.runs(experiment.name) == runs
    for run, history in histories.items():
        record = study.record(experiment.name, run)
        require_equal(record, from_bytes(encode_record(make_record(history))))


def test_runs_whose_arrays_differ_in_shape_are_stored_separately(tmp_path: Path) -> None:
    experiment = EXPERIMENTS["small"]
    study = create_study(tmp_path, [experiment], SEED)
    histories = simulate_histories(experiment, SEED, range(60))
    for history in histories[20:40]:
        history.stored_run_arrays[0] = {"archive": np.arange(3.0)}
    for history in histories[40:]:
        history.stored_run_arrays[0] = {"archive": np.arange(4.0)}
    store(study, histories)
    assert list_names(study) == ["0000-0019.nc", "0020-0039.nc", "0040-0059.nc"]
    for run, size in ((0, None), (20, 3), (59, 4)):
        record = study.record(experiment.name, run)
        sizes = [array.size for name, array in record.data_vars.items() if "archive" in str(name)]
        assert sizes == ([] if size is None else [size])


def test_large_arrays_of_the_runs_reduce_the_number_of_runs_in_a_file(tmp_path: Path) -> None:
    experiment = EXPERIMENTS["small"]
    study = create_study(tmp_path, [experiment], SEED)
    histories = simulate_histories(experiment, SEED, range(RUNS))
    for history in histories:
        history.stored_run_arrays[0] = {"archive": np.zeros(2**19)}
    store(study, histories)
    # A file has at most 64 MiB of arrays of 4 MiB.
    assert list_names(study) == ["0000-0015.nc", "0016-0023.nc"]


@pytest.mark.parametrize(
    ("generations", "steps", "n_runs"),
    [(100, 5000, 1), (10, 2000, 1), (10, 1000, 25), (2, 20, 1000)],
)
def test_the_number_of_runs_in_a_file_follows_from_the_agent_steps(
    generations: int, steps: int, n_runs: int
) -> None:
    experiment = bl.load("evo/A").replace(
        evolution={"generations": generations}, lifetime={"steps": steps}
    )
    assert memory.runs_per_file(experiment) == n_runs


EXPERIMENT = shorten_preset("evo/A").replace(evolution={"generations": 6}, lifetime={"steps": 50})


class Attempt:
    """An attempt of a task, which records its progress and the simulated generations."""

    def __init__(self, study: StudyStore, runs: tuple[int, ...], stop_after: int = 1000) -> None:
        self.reports: list[int] = []
        self.simulated: list[tuple[int, int]] = []
        self._stop_after = stop_after
        self.task = RunTask(
            EXPERIMENT,
            runs,
            is_new=True,
            checkpoint_interval=Interval(generations=1),
            callback=self._add_generation,
        )
        self.task.run(SEED, study.directory, CPU, self._report)

    def _add_generation(self, data: xr.Dataset) -> None:
        self.simulated.append((int(data.attrs["run"]), data.sizes["generation"] - 1))

    def _report(self, agent_steps: int) -> None:
        self.reports.append(agent_steps)
        if len(self.reports) == self._stop_after:
            raise StoppedError


@pytest.fixture
def study(tmp_path: Path) -> StudyStore:
    return create_study(tmp_path / "study", [EXPERIMENT], SEED)


@pytest.fixture
def expected(tmp_path: Path) -> dict[str, bytes]:
    return read_records(make_small_study(tmp_path / "threads", [EXPERIMENT], 4, SEED).directory)


def test_runs_that_another_process_has_stored_are_not_simulated_again(
    study: StudyStore, expected: dict[str, bytes]
) -> None:
    Attempt(study, (1, 3))
    attempt = Attempt(study, (0, 1, 2, 3))
    assert {run for run, _ in attempt.simulated} == {0, 2}
    assert sum(attempt.reports) == attempt.task.agent_steps
    assert read_records(study.directory) == expected


def test_a_repeated_task_continues_from_the_checkpoints_of_a_lost_worker(
    study: StudyStore, expected: dict[str, bytes]
) -> None:
    with pytest.raises(StoppedError):
        Attempt(study, (0, 1, 2, 3), stop_after=4)
    checkpoints = [checkpoint_path(study.directory, "evo/A", run) for run in range(4)]
    assert all(path.exists() for path in checkpoints)
    attempt = Attempt(study, (0, 1, 2, 3))
    # The last stored generation is simulated again.
    assert attempt.simulated == [(run, generation) for generation in (3, 4, 5) for run in range(4)]
    assert sum(attempt.reports) == attempt.task.agent_steps
    assert read_records(study.directory) == expected
    assert not any(path.exists() for path in checkpoints)


def test_a_short_task_lists_no_files(
    study: StudyStore, expected: dict[str, bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    task = RunTask(EXPERIMENT, (0, 1, 2, 3), is_new=True)
    assert task.agent_steps < run_task.MIN_STEPS_OF_SEARCH
    monkeypatch.delattr("baldwinlab.studies.record_files.list_names")
    task.run(SEED, study.directory, CPU, lambda agent_steps: None)
    monkeypatch.undo()
    assert read_records(study.directory) == expected
