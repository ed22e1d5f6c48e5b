"""A lazily opened study equals the concatenation of its records."""

from __future__ import annotations

import random
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import baldwinlab as bl
from baldwinlab.core.variables import GENERATION_COUNT
from baldwinlab.experiment import Experiment
from baldwinlab.simulation import memory
from baldwinlab.studies import recorded_arrays, run_task
from baldwinlab.studies.creation import extend_study
from baldwinlab.studies.lazy_runs import make_empty_dataset
from baldwinlab.studies.open import label_conditions, open_conditions, open_runs
from baldwinlab.studies.records import DamagedRecordError, StudyError
from baldwinlab.studies.run import run_study
from baldwinlab.studies.store import StudyStore
from tests.small_studies import ignore_message, ignore_progress, make_small_study, shorten_preset

RUNS = 24
SEED = 8


def open_eagerly(study: StudyStore) -> xr.Dataset:
    """Read one record after the other, and concatenate them."""
    datasets = []
    for name in study.experiments:
        runs = study.runs(name)
        if not runs:
            datasets.append(make_empty_dataset(study.experiments[name]))
            continue
        records = [study.read(name, run, genomes=False) for run in runs]
        data = xr.concat(records, "run", join="outer", combine_attrs="drop")
        data = data.assign_coords(run=np.array(runs, np.int32))
        for variable, array in records[0].data_vars.items():
            data[variable].attrs = array.attrs
        datasets.append(data)
    data = xr.concat(
        datasets, "condition", join="outer", data_vars="all", coords="minimal", combine_attrs="drop"
    )
    attributes = [
        {name: variable.attrs for name, variable in dataset.data_vars.items()}
        for dataset in datasets
    ]
    return label_conditions(study, list(study.experiments), data, attributes)


def make_experiment(name: str = "evo/A", **changes: object) -> Experiment:
    settings = {"evolution": {"generations": 3}, "lifetime": {"steps": 60}}
    return shorten_preset().replace(**{"name": name, **settings, **changes})


STOP = {"generations": 8, "stop": "target-fitness", "target_fitness": {"target": 8.5}}
CONDITIONS: dict[str, list[Experiment]] = {
    "equal sizes": [make_experiment("a"), make_experiment("b", learning={"rate": 0.5})],
    "other numbers of agents": [
        make_experiment("a"),
        make_experiment("b", population={"size": 7}, evolution={"generations": 5}),
    ],
    "stopped runs": [
        make_experiment("a", evolution=STOP, lifetime={"steps": 300}),
        make_experiment("b"),
    ],
    "time series": [
        make_experiment("a", record={"every": 20}),
        make_experiment("b", record={"every": 15}),
    ],
    "other models": [
        bl.load("stanley-miikkulainen-2002:neat").replace(evolution={"generations": 4}),
        make_experiment("b"),
    ],
}


@pytest.fixture(scope="module", params=CONDITIONS)
def study(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> StudyStore:
    directory = tmp_path_factory.mktemp("open") / "study"
    return make_small_study(directory, CONDITIONS[request.param], RUNS, SEED, workers=1)


def require_equal(study: StudyStore) -> None:
    data = open_runs(study.directory)
    expected = open_eagerly(study)
    if GENERATION_COUNT in data.coords:
        data = data.drop_vars(GENERATION_COUNT)
    assert {name: data[name].dtype for name in data.variables} == {
        name: expected[name].dtype for name in expected.variables
    }
    xr.testing.assert_identical(data, expected)


def test_the_dataset_is_identical_to_the_concatenated_records(study: StudyStore) -> None:
    assert [file.path.name for file in study.files(next(iter(study.experiments)))] == [
        "0000-0023.nc"
    ]
    require_equal(study)


@pytest.mark.parametrize("whole_bytes", [0, 2**30], ids=["parts", "whole variables"])
@pytest.mark.parametrize(
    "seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.nightly) for seed in range(2, 6))]
)
def test_any_selection_equals_the_selection_of_loaded_values(
    study: StudyStore, seed: int, whole_bytes: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recorded_arrays, "MAX_WHOLE_BYTES", whole_bytes)
    expected = open_eagerly(study)
    numbers = random.Random(seed)
    for name in expected.data_vars:
        if name == "experiment":
            continue
        data = open_runs(study.directory)[name]
        if GENERATION_COUNT in data.coords:
            data = data.drop_vars(GENERATION_COUNT)
        selection = {
            dim: choose_indices(size, numbers) for dim, size in expected[name].sizes.items()
        }
        xr.testing.assert_identical(data.isel(selection), expected[name].isel(selection))


def choose_indices(size: int, numbers: random.Random) -> int | slice | Sequence[int]:
    first, last = sorted(numbers.choices(range(size), k=2))
    choices: list[int | slice | Sequence[int]] = [
        first,
        -1,
        slice(first, last + 1),
        slice(None),
        slice(None, None, 2),
        slice(None, None, -1),
        [numbers.randrange(size) for _ in range(3)],
    ]
    return numbers.choice(choices)


def test_runs_in_single_files_batches_and_overlapping_files_are_one_dataset(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run_task, "MIN_RUNS_PER_BATCH", 2)
    monkeypatch.setattr(memory, "MIN_RUNS_PER_BATCH", 2)
    experiments = [make_experiment("a"), make_experiment("b")]
    study = make_small_study(tmp_path, experiments, 10, SEED, workers=1)
    run_study(study, {"a": [3], "b": [20, 21]}, 1, ignore_progress, ignore_message)
    run_study(study, {"a": [5, 6, 7, 8, 14]}, 2, ignore_progress, ignore_message)
    assert len(study.files("a")) >= 4
    require_equal(study)


def test_a_study_in_the_middle_of_an_extension_is_padded(tmp_path: Path) -> None:
    study = make_small_study(tmp_path, [make_experiment("a")], RUNS, SEED, workers=1)
    extended = extend_study(study, 5)
    run_study(extended, {"a": [2, 3, 11]}, 1, ignore_progress, ignore_message)
    data = open_runs(tmp_path)
    assert data.sizes["generation"] == 5
    assert data["energy"].dtype == np.float64
    assert data["parents"].dtype == np.float64
    is_complete = data["energy"].isel(generation=-1).notnull().all("agent").values[0]
    assert np.flatnonzero(is_complete).tolist() == [2, 3, 11]
    require_equal(extended)


def test_conditions_without_runs_are_null(tmp_path: Path) -> None:
    experiments = [make_experiment("a"), make_experiment("b", evolution={"generations": 4})]
    study = make_small_study(tmp_path, experiments, RUNS, SEED, workers=1)
    for file in study.files("b"):
        file.path.unlink()
    require_equal(study)
    # A study without any run has an empty dataset.
    for file in study.files("a"):
        file.path.unlink()
    energy = open_runs(tmp_path).energy
    assert dict(energy.sizes) == {"condition": 2, "run": 0, "generation": 4, "agent": 20}
    assert energy.values.size == 0


def test_opening_reads_no_values_and_a_value_is_read_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = make_small_study(tmp_path, [make_experiment("a")], RUNS, SEED, workers=1)
    reads: list[str] = []
    read = recorded_arrays._read_part

    def record_read(path: Path, name: str) -> object:
        reads.append(name)
        return read(path, name)

    monkeypatch.setattr(recorded_arrays, "_read_part", record_read)
    data = open_conditions(study, ["a"])
    assert reads == []
    for run in range(RUNS):
        data["energy"].isel(run=run).mean().item()
    assert reads == ["energy"]
    data.load()
    assert sorted(reads) == ["energy", "food_eaten", "parents"]


def test_a_file_that_is_changed_after_the_opening_is_reported(tmp_path: Path) -> None:
    study = make_small_study(tmp_path, [make_experiment("a")], RUNS, SEED, workers=1)
    (file,) = study.files("a")
    content = file.path.read_bytes()
    data = open_runs(tmp_path)
    file.path.write_bytes(content)
    assert data["energy"].load().notnull().all(), "the same content is no change"
    data = open_runs(tmp_path)
    file.path.write_bytes(content[:-8])
    with pytest.raises(DamagedRecordError, match=f"{file.path} is damaged"):
        data["energy"].load()
    file.path.write_bytes(content)
    data = open_runs(tmp_path)
    extended = extend_study(study, 4)
    run_study(extended, {"a": list(range(RUNS))}, 1, ignore_progress, ignore_message)
    with pytest.raises(StudyError, match=r"has been changed since .*: open the study again"):
        data["energy"].load()
