"""A run that is killed or extended continues from its stored generations, with the same bits."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.core.errors import ArgumentError, RefusedError
from baldwinlab.experiment import BaseExperiment, Experiment, ExperimentError
from baldwinlab.simulation.history import Histories
from baldwinlab.simulation.records import encode_history, make_record
from baldwinlab.simulation.simulate import continue_histories, simulate_histories
from baldwinlab.studies.checkpoints import Interval, checkpoint_path, read_longest_record
from baldwinlab.studies.creation import create_study, extend_study
from baldwinlab.studies.open import open_runs
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.run import find_missing_runs, plan_tasks, run_study
from baldwinlab.studies.store import StudyStore
from tests.small_studies import (
    ignore_message,
    ignore_progress,
    make_small_study,
    read_records,
    shorten_preset,
)
from tests.studies import test_run_task
from tests.studies.completion import (
    complete_runs,
    read_files,
    require_continuable,
    stop_after_generations,
)

GENERATIONS = 6


def make_experiment(name: str, **changes: Any) -> BaseExperiment:
    return bl.load(name).replace(evolution={"generations": GENERATIONS}, **changes)


EXPERIMENTS = {
    name: experiment.replace(evolution={"generations": GENERATIONS, "stop": "none"})
    for name, experiment in test_run_task.EXPERIMENTS.items()
} | {
    "lamarckian": make_experiment("evo+self-taught/A", lifetime={"steps": 100}).replace(
        evolution={"lamarckian_share": 0.5}
    ),
    "bit strings": make_experiment("hinton-nowlan-1987:guessing"),
}
DAILY_EXPERIMENTS = ("small", "few stored genomes", "lamarckian", "bit strings")


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.nightly] * (name not in DAILY_EXPERIMENTS))
        for name in EXPERIMENTS
    ],
)
@pytest.mark.parametrize("stored", [1, 4, GENERATIONS])
def test_a_history_that_begins_with_a_record_has_the_bits_of_an_uninterrupted_one(
    name: str, stored: int
) -> None:
    require_continuable(EXPERIMENTS[name], stored)


def test_a_stopped_study_continues_from_its_checkpoints_to_the_same_bits(tmp_path: Path) -> None:
    experiment = shorten_preset("evo+self-taught/A").replace(evolution={"generations": GENERATIONS})
    study = create_study(tmp_path / "stopped", [experiment], seed=5)
    stop_after_generations(study, runs=2, count=3)
    assert checkpoint_path(study.directory, experiment.name, 0).exists()
    assert not study.runs(experiment.name)

    missing = find_missing_runs(study, 2, ignore_message)
    (task,) = plan_tasks(study, missing, 1)
    assert task.n_stored >= 1
    per_generation = 2 * experiment.steps * experiment.population.size
    assert task.agent_steps == per_generation * (GENERATIONS - task.n_stored)
    run_study(study, missing, 1, ignore_progress, ignore_message)

    complete = make_small_study(tmp_path / "whole", [experiment], runs=2)
    assert read_records(study.directory) == read_records(complete.directory)
    assert not list(study.directory.rglob("*.checkpoint"))


def test_a_run_that_begins_again_removes_the_checkpoint_of_its_first_generation(
    tmp_path: Path,
) -> None:
    experiment = shorten_preset("evo/A")
    study = create_study(tmp_path, [experiment], seed=5)
    (history,) = simulate_histories(experiment.replace(evolution={"generations": 1}), 5, [0])
    path = checkpoint_path(study.directory, experiment.name, 0)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(encode_history(history))
    complete_runs(study, 1)
    assert study.runs(experiment.name) == [0]
    assert not path.exists()


@pytest.mark.parametrize("content", [b"", b"not a checkpoint", None], ids=["empty", "text", "cut"])
def test_a_damaged_checkpoint_is_ignored(tmp_path: Path, content: bytes | None) -> None:
    experiment = shorten_preset("evo/A").replace(evolution={"generations": GENERATIONS})
    study = create_study(tmp_path / "stopped", [experiment], seed=5)
    stop_after_generations(study, runs=1, count=3)
    path = checkpoint_path(study.directory, experiment.name, 0)
    path.write_bytes(path.read_bytes()[:-50] if content is None else content)
    assert read_longest_record(study.directory, experiment, 5, 0) is None
    complete_runs(study, 1)
    complete = make_small_study(tmp_path / "whole", [experiment], runs=1)
    assert read_records(study.directory) == read_records(complete.directory)


def test_a_record_that_cannot_be_repeated_is_not_continued() -> None:
    experiment = shorten_preset("evo/A")
    (history,) = simulate_histories(experiment.replace(evolution={"generations": 2}), 5, [0])
    record = make_record(history)
    record["energy"][-1, 0] += 1
    with pytest.raises(RefusedError, match="run 0 of evo/A cannot be continued: generation 1"):
        continue_histories(Histories(experiment, 5, [0], [record]))


@pytest.mark.parametrize("text", ["", "0", "0s", "-1", "1.5", "10m", "s", "1" * 10])
def test_an_interval_is_a_number_of_seconds_or_of_generations(text: str) -> None:
    assert Interval.parse("60s") == Interval(seconds=60)
    assert Interval.parse("100") == Interval(generations=100)
    with pytest.raises(ArgumentError, match="must be a number of generations or of seconds"):
        Interval.parse(text)


def extended_experiments(generations: int) -> list[Experiment]:
    return [
        shorten_preset(name).replace(evolution={"generations": generations})
        for name in ("evo/A", "evo+self-taught/A")
    ]


def test_an_extended_study_has_the_same_files_as_a_study_that_is_run_at_once(
    tmp_path: Path,
) -> None:
    study = extend_study(make_small_study(tmp_path / "extended", runs=2), 5)
    assert find_missing_runs(study, 2, ignore_message) == {
        "evo/A": [0, 1],
        "evo+self-taught/A": [0, 1],
    }
    complete_runs(study, 3, 2)
    complete = make_small_study(tmp_path / "whole", extended_experiments(5), runs=3)
    assert read_records(study.directory) == read_records(complete.directory)
    for name in study.experiments:
        path = Path("runs") / name / "experiment.toml"
        assert (study.directory / path).read_text() == (complete.directory / path).read_text()


def test_a_study_that_is_not_yet_extended_opens_with_gaps(tmp_path: Path) -> None:
    study = extend_study(make_small_study(tmp_path, runs=2), 5)
    before = open_runs(study.directory).load()
    assert before.sizes["generation"] == 3
    complete_runs(study, 1, 2)
    partly = open_runs(study.directory)
    assert partly.sizes["generation"] == 5
    assert np.isnan(partly["energy"].isel(run=1, generation=slice(3, None))).all()
    assert partly["energy"].isel(run=0).notnull().all()
    assert partly["energy"].isel(generation=slice(3)).equals(before["energy"])


def test_an_extension_to_the_same_number_of_generations_writes_nothing(tmp_path: Path) -> None:
    study = make_small_study(tmp_path, runs=1)
    before = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*") if path.is_file()}
    extend_study(study, 3)
    assert before == {
        path: path.stat().st_mtime_ns for path in tmp_path.rglob("*") if path.is_file()
    }


@pytest.mark.parametrize(
    ("generations", "error", "sentence"),
    [
        (2, StudyError, "generations = 2 must be at least 3, the generations of evo/A"),
        (10_000_000, ExperimentError, "evolution.generations"),
    ],
)
def test_a_wrong_number_of_generations_is_refused_before_anything_is_written(
    tmp_path: Path, generations: int, error: type[Exception], sentence: str
) -> None:
    study = make_small_study(tmp_path, runs=1)
    before = read_files(tmp_path)
    with pytest.raises(error, match=sentence):
        extend_study(study, generations)
    assert read_files(tmp_path) == before


def test_a_sweep_is_not_extended(tmp_path: Path) -> None:
    study = create_study(tmp_path, [shorten_preset("evo/A")], seed=5, kind="sweep")
    with pytest.raises(StudyError, match="is a sweep, and only a study of conditions"):
        extend_study(study, 5)


def test_the_extended_study_of_a_paper_records_the_change(tmp_path: Path) -> None:
    study = create_study(
        tmp_path, [shorten_preset("evo/A")], seed=5, paper="le-2019", changes=["lifetime.steps=300"]
    )
    study = extend_study(extend_study(study, 4), 5)
    assert study.changes == ("lifetime.steps=300", "evolution.generations=5")


def test_an_interrupted_extension_is_completed(tmp_path: Path) -> None:
    study = make_small_study(tmp_path / "interrupted", runs=1)
    complete = make_small_study(tmp_path / "whole", extended_experiments(5), runs=1)
    # Only the first condition has its new number of generations.
    path = Path("runs") / "evo/A" / "experiment.toml"
    (study.directory / path).write_bytes((complete.directory / path).read_bytes())
    study = extend_study(StudyStore(study.directory), 5)
    complete_runs(study, 1, 2)
    assert read_records(study.directory) == read_records(complete.directory)
