"""An extended study has the bits of a study that is run at once."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from baldwinlab.experiment import Experiment, ExperimentError
from baldwinlab.studies.creation import create_study, extend_study
from baldwinlab.studies.open import open_runs
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.run import find_missing_runs
from baldwinlab.studies.store import StudyStore
from tests.small_studies import (
    ignore_message,
    make_small_study,
    read_records,
    shorten_preset,
)
from tests.studies.completion import complete_runs, read_files


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
