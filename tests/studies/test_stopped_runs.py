"""A study whose runs stop: storage, completeness, extension, checkpoints, data and assays."""

from __future__ import annotations

import shutil
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import baldwinlab as bl
from baldwinlab.analysis.statistics import fitness
from baldwinlab.core.errors import RefusedError
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.backends.choice import CPU
from baldwinlab.studies.assays.results import read_assays
from baldwinlab.studies.assays.run import run_assays
from baldwinlab.studies.checkpoints import Interval, checkpoint_path
from baldwinlab.studies.creation import create_study, extend_study
from baldwinlab.studies.executors import THREADS
from baldwinlab.studies.open import open_runs
from baldwinlab.studies.run import find_missing_runs, plan_tasks, run_study
from baldwinlab.studies.status import provenance
from baldwinlab.studies.store import StudyStore
from tests.small_studies import (
    ignore_message,
    ignore_progress,
    make_small_study,
    read_records,
    shorten_preset,
)

GENERATIONS = 12
RUNS = 4
SEED = 8
TARGET = 8.5


def make_experiment(target: float | None = TARGET, name: str = "evo/A") -> Experiment:
    evolution: dict[str, Any] = {"generations": GENERATIONS}
    if target is not None:
        evolution |= {"stop": "target-fitness", "target_fitness": {"target": target}}
    return shorten_preset(name).replace(evolution=evolution)


@pytest.fixture(scope="module")
def complete(tmp_path_factory: pytest.TempPathFactory) -> xr.Dataset:
    """The same runs without a stop."""
    directory = tmp_path_factory.mktemp("complete") / "study"
    make_small_study(directory, [make_experiment(target=None)], RUNS, SEED)
    return open_runs(directory)


@pytest.fixture(scope="module")
def stopped(tmp_path_factory: pytest.TempPathFactory) -> StudyStore:
    directory = tmp_path_factory.mktemp("stopped") / "study"
    return make_small_study(directory, [make_experiment()], RUNS, SEED)


@pytest.fixture(scope="module")
def expected(complete: xr.Dataset) -> list[int]:
    """The numbers of generations of the stopped runs, by a search in the complete runs."""
    lengths = []
    for means in complete.energy.mean("agent").values[0]:
        above = [generation for generation, mean in enumerate(means) if mean >= TARGET]
        lengths.append(above[0] + 1 if above else GENERATIONS)
    assert len(set(lengths)) > 2
    return lengths


def test_the_data_of_a_stopped_run_are_those_of_a_complete_run_and_then_nan(
    stopped: StudyStore, complete: xr.Dataset, expected: list[int]
) -> None:
    data = open_runs(stopped.directory)
    assert "n_generations" not in complete.coords
    assert data["n_generations"].values.tolist() == [expected]
    assert data.sizes["generation"] == max(expected)
    is_simulated = data["generation"] < data["n_generations"]
    cut = complete.isel(generation=slice(max(expected))).where(is_simulated)
    for name in ("energy", "food_eaten", "parents"):
        xr.testing.assert_equal(
            data[name].drop_vars("n_generations"), cut[name].drop_vars("n_generations")
        )


def test_a_study_whose_runs_have_stopped_is_complete(
    stopped: StudyStore, expected: list[int]
) -> None:
    assert find_missing_runs(stopped, RUNS, ignore_message) == {"evo/A": []}
    assert not list(stopped.directory.rglob("*.checkpoint"))
    experiment = stopped.experiments["evo/A"]
    steps_per_generation = experiment.steps * experiment.population.size
    n_steps = provenance(stopped, "")["agent_steps"]
    assert n_steps == sum(expected) * steps_per_generation
    frame = bl.open_study(stopped.directory).to_pandas()
    assert frame.groupby("run")["generation"].nunique().tolist() == expected
    assert not frame["energy"].isna().any()


def test_an_extension_continues_only_the_runs_that_have_not_stopped(tmp_path: Path) -> None:
    long = make_small_study(tmp_path / "long", [make_experiment()], RUNS, SEED)
    short_experiment = make_experiment().replace(evolution={"generations": 4})
    short = make_small_study(tmp_path / "short", [short_experiment], RUNS, SEED)
    n_stopped = sum("stopped_by" in short.attributes("evo/A", run) for run in range(RUNS))
    assert 0 < n_stopped < RUNS
    extended = extend_study(short, GENERATIONS)
    missing = find_missing_runs(extended, RUNS, ignore_message)
    assert len(missing["evo/A"]) == RUNS - n_stopped
    run_study(extended, missing, 1, ignore_progress, ignore_message)
    assert read_records(extended.directory) == read_records(long.directory)


def test_an_interrupted_study_continues_to_the_same_bits(
    tmp_path: Path, stopped: StudyStore
) -> None:
    study = create_study(tmp_path / "interrupted", [make_experiment()], SEED)
    missing = find_missing_runs(study, RUNS, ignore_message)
    interval = Interval(generations=1)
    (task,) = plan_tasks(study, missing, 1, CPU.worlds, interval, is_one_process=False)
    n_calls = 0

    def interrupt(amount: int) -> None:
        nonlocal n_calls
        n_calls += 1
        if n_calls == 4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        task.run(SEED, study.directory, CPU, interrupt)
    stored = study.runs("evo/A")
    assert stored
    assert any(checkpoint_path(study.directory, "evo/A", run).exists() for run in range(RUNS))
    missing = find_missing_runs(study, RUNS, ignore_message)
    assert not {*missing["evo/A"]} & {*stored}
    run_study(study, missing, 1, ignore_progress, ignore_message)
    assert read_records(study.directory) == read_records(stopped.directory)
    assert not list(study.directory.rglob("*.checkpoint"))


def test_the_progress_of_a_stopped_run_reaches_the_total(tmp_path: Path) -> None:
    study = create_study(tmp_path / "progress", [make_experiment()], SEED)
    missing = find_missing_runs(study, RUNS, ignore_message)
    tasks = plan_tasks(study, missing, 2)
    amounts = list(THREADS.run(study, tasks, 2, CPU))
    assert sum(amounts) == sum(task.agent_steps for task in tasks)


def test_the_last_generations_and_curves_end_with_each_run(
    stopped: StudyStore, complete: xr.Dataset, expected: list[int]
) -> None:
    final = fitness.final(open_runs(stopped.directory), "mean", last=2)
    means = complete.energy.mean("agent").values[0]
    for value, run_means, length in zip(final.values[0], means, expected, strict=True):
        np.testing.assert_allclose(value, run_means[max(0, length - 2) : length].mean())
    # A stopped run keeps its last value in curves.
    curves = fitness.mean(open_runs(stopped.directory))
    assert curves.dims == ("condition", "run", "generation")
    assert not curves.isnull().any()
    for curve, length in zip(curves.values[0], expected, strict=True):
        np.testing.assert_array_equal(curve[length - 1 :], curve[length - 1])


def test_a_lifetime_after_the_end_of_a_run_is_refused_in_one_sentence(
    stopped: StudyStore, expected: list[int], tmp_path: Path
) -> None:
    run = int(np.argmin(expected))
    last = expected[run] - 1
    study = bl.open_study(stopped.directory)
    sentence = rf"generation = {last + 1}: run {run} of evo/A has the generations 0 to {last}$"
    assert study.replay(run=run, generation=last).sizes["step"] == 300
    after: dict[str, Any] = {"run": run, "generation": last + 1}
    replay = partial(bl.replay, make_experiment(), seed=SEED)
    calls: list[Any] = [study.replay, study.genomes, replay]
    for call in calls:
        with pytest.raises(RefusedError, match=sentence):
            call(**after)
    reference = f"{stopped.directory}:evo/A@{GENERATIONS - 1}"
    with pytest.raises(RefusedError, match=r"run \d+ of evo/A has the generations 0 to \d+$"):
        bl.freeze(reference, out=tmp_path / "population.nc")
    assert not (tmp_path / "population.nc").exists()


def test_assays_measure_the_last_generation_of_a_stopped_run(
    stopped: StudyStore, expected: list[int], tmp_path: Path
) -> None:
    # Other tests compare all files of the study.
    stopped = StudyStore(shutil.copytree(stopped.directory, tmp_path / "copy"))
    names = ["innate", "neutral", "descent", "reaction", "within-life"]
    run_assays(stopped, {"evo/A": names}, 2, ignore_progress, ignore_message)
    assays = read_assays(stopped)
    records = [stopped.record("evo/A", run) for run in range(RUNS)]
    innate = assays["innate"]["evo/A"]["energy"].sel(life="off").values
    for run_energy, record, length in zip(innate, records, expected, strict=True):
        np.testing.assert_array_equal(run_energy[:length], record.energy.values)
        for energy in run_energy[length:]:
            np.testing.assert_array_equal(energy, record.energy.values[-1])
    ages = assays["descent"]["evo/A"]["effective_ancestors"].values
    for run_ages, length in zip(ages, expected, strict=True):
        np.testing.assert_array_equal(run_ages[length - 1 :], run_ages[length - 1])
    assert not assays["reaction"]["evo/A"]["energy"].isnull().any()
