"""A study chooses its backend before it is created."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

import baldwinlab as bl
from baldwinlab.api.run_study import StudyRequest, _choose_backend, count_missing_runs
from baldwinlab.models.miniworld.backends import cuda
from baldwinlab.studies import checkpoints
from baldwinlab.studies.creation import extend_study
from baldwinlab.studies.executors import THREADS
from tests.small_studies import make_small_study, shorten_preset
from tests.studies.completion import complete_runs
from tests.worlds import make_small_experiment

SPECIES = [{"name": "first", "size": 3}, {"name": "second", "size": 3}]


def test_many_runs_of_species_use_the_cpu_if_a_gpu_is_available(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cuda, "unavailable_reason", lambda: None)
    long_life = {"lifetime": {"steps": 10**6}}
    single = make_small_experiment("evo", **long_life)
    species = make_small_experiment("evo", population={"species": SPECIES}, **long_life)
    for experiment, name in ((single, "cuda"), (species, "cpu")):
        request = StudyRequest([experiment], tmp_path, runs=10**4, seed=0)
        assert _choose_backend("auto", THREADS, request).name == name
    with pytest.raises(ValueError, match="runs on the CPU only"):
        _choose_backend("cuda", THREADS, StudyRequest([species], tmp_path, runs=1, seed=0))


def test_run_stores_checkpoints_at_the_given_interval(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    saved: list[str] = []

    def write_name(directory: Path, path: Path, content: bytes) -> None:
        saved.append(path.name)

    monkeypatch.setattr(checkpoints, "write_in_study", write_name)
    bl.run(shorten_preset("evo/A"), runs=1, out=tmp_path / "new", checkpoint="2")
    assert saved == ["0000.checkpoint"]


def test_the_estimate_of_an_interrupted_extension_counts_its_short_runs(tmp_path: Path) -> None:
    study = make_small_study(tmp_path / "study", [shorten_preset("evo/A")], runs=2)
    extended = extend_study(study, 5)
    # The run 0 has 5 generations, the run 1 has 3, and the runs 2 and 3 are missing.
    complete_runs(extended, 1)
    (experiment,) = extended.experiments.values()
    request = StudyRequest([experiment], study.directory, runs=4, seed=study.seed)
    assert count_missing_runs(request, experiment) == 3
    longer = experiment.replace(evolution={"generations": 6})
    assert count_missing_runs(request, longer) == 4
    assert count_missing_runs(replace(request, first_run=1), experiment) == 4
    complete_runs(extended, 4)
    assert count_missing_runs(request, experiment) == 0
