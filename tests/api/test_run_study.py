"""A study chooses its backend before it is created."""

from __future__ import annotations

from pathlib import Path

import pytest

import baldwinlab as bl
from baldwinlab.api.run_study import StudyRequest, _choose_backend
from baldwinlab.models.miniworld.backends import cuda
from baldwinlab.studies import checkpoints
from baldwinlab.studies.executors import THREADS
from tests.small_studies import shorten_preset
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
