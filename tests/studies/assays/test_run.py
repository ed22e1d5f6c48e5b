"""Assays of a study are the same however they came about, and stay true to what is stored."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from baldwinlab.core.variables import ASSAYS as DECLARED
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.backends import cpu
from baldwinlab.studies.assays.catalog import ASSAYS
from baldwinlab.studies.assays.results import find_missing_assays, open_assay
from baldwinlab.studies.assays.run import count_assay_steps, run_assays
from baldwinlab.studies.creation import create_study
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore
from tests.small_studies import ignore_message, ignore_progress, make_small_study, read_records
from tests.studies.assays.studies import conditions, measured
from tests.worlds import make_small_experiment

NOTHING: dict[str, list[str]] = {experiment.name: [] for experiment in conditions()}


def stored(study: StudyStore) -> dict[str, bytes]:
    return read_records(study.directory / "assays")


def test_assays_hold_what_is_declared(study: StudyStore) -> None:
    for name, declared in DECLARED.items():
        found = open_assay(study.directory, name, "evo+self-taught/A")
        assert set(found.data_vars) == set(declared)
        for variable, meaning in declared.items():
            assert found[variable].dims == meaning.dims
            assert found[variable].dtype == meaning.dtype
        assert all(dim in found.coords for dim in found.dims)
        assert found.run.values.tolist() == [0, 1, 2]
        assert {"condition", "seed", "experiment", "baldwinlab"} == set(found.attrs)


def test_the_number_of_workers_makes_no_difference(study: StudyStore, tmp_path: Path) -> None:
    assert stored(measured(tmp_path / "one", workers=1)) == stored(study)
    assert stored(measured(tmp_path / "many", workers=7)) == stored(study)


def test_progress_is_told_to_the_last_agent_step(tmp_path: Path) -> None:
    study = make_small_study(tmp_path, conditions())
    done: list[int] = []

    @contextmanager
    def noted(description: str, total: int) -> Iterator[Callable[[int], None]]:
        done.append(-total)
        yield done.append

    run_assays(study, find_missing_assays(study, list(ASSAYS)), 2, noted, ignore_message)
    assert done[0] < 0
    assert sum(done) == 0


def test_all_that_is_lived_has_been_compiled_beforehand(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    begin, ready, lived = cpu.CpuBatch.__init__, set[Any](), set[Any]()

    def noted(self: cpu.CpuBatch, experiment: Experiment, seed: int, runs: Sequence[int]) -> None:
        lived.add(cpu.code_key(experiment))
        begin(self, experiment, seed, runs)

    def warm_up(experiments: Iterable[Experiment], **options: Any) -> float:
        ready.update(map(cpu.code_key, experiments))
        return 0.0

    monkeypatch.setattr("baldwinlab.studies.assays.run.compile_experiments", warm_up)
    monkeypatch.setattr(cpu.CpuBatch, "__init__", noted)
    measured(tmp_path)
    assert lived == ready


def test_what_is_stored_is_not_measured_again(study: StudyStore) -> None:
    assert find_missing_assays(study, list(ASSAYS)) == NOTHING
    assert count_assay_steps(study, NOTHING) == 0


def test_what_no_longer_fits_is_measured_again(tmp_path: Path) -> None:
    study = measured(tmp_path, names=["modules", "descent"])
    whole = stored(study)
    make_small_study(tmp_path, conditions(), runs=4)
    study.path("evo/A", 3).unlink()
    torn = tmp_path / "assays/descent/evo/A.nc"
    torn.write_bytes(torn.read_bytes()[:-200])
    (tmp_path / "assays/modules/self-taught/A.nc").unlink()
    missing = find_missing_assays(study, ["modules", "descent"])
    both = ["modules", "descent"]
    assert missing == {
        "evo/A": ["descent"],
        "evo+self-taught/A": both,
        "self-taught/A": both,
        "evo+self-taught/B": both,
    }
    run_assays(study, missing, 2, ignore_progress, ignore_message)
    assert open_assay(tmp_path, "modules", "self-taught/A").sizes["run"] == 4
    assert stored(study)["descent/evo/A.nc"] == whole["descent/evo/A.nc"]


def test_an_error_ends_the_work_and_keeps_what_is_stored(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = measured(tmp_path, names=["descent"])
    before = stored(study)

    def no_space(handle: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", no_space)
    with pytest.raises(OSError, match="no space is left"):
        run_assays(
            study,
            find_missing_assays(study, ["modules", "innate"]),
            2,
            ignore_progress,
            ignore_message,
        )
    assert stored(study) == before


def test_genomes_that_were_not_kept_give_the_same_results(
    study: StudyStore, tmp_path: Path
) -> None:
    thinned = [experiment.replace(record={"genome_every": 3}) for experiment in conditions()]
    measured(tmp_path, thinned)
    for name in ASSAYS:
        whole = open_assay(study.directory, name, "evo+self-taught/B")
        assert whole.drop_attrs().identical(
            open_assay(tmp_path, name, "evo+self-taught/B").drop_attrs()
        )


@pytest.mark.parametrize(
    "changes",
    [
        {"population": {"size": 1}},
        {"world": {"food": []}},
        {"evolution": {"generations": 1}},
        {"lifetime": {"steps": 1}},
        {"network": {"hidden": [], "biases": True}},
        {
            "learning": {
                "cost_per_step": 0.01,
                "cost_per_change": 0.1,
                "evolved_rate": True,
                "teacher": "fresh",
            }
        },
        {"evolution": {"lamarckian_share": 1.0}, "record": {"genome_every": 2}},
        {"learning": {"rule": "drift"}},
    ],
)
def test_the_smallest_and_the_strangest_studies_can_be_measured(
    tmp_path: Path, changes: dict[str, object]
) -> None:
    study = measured(
        tmp_path, [make_small_experiment("evo+self-taught").replace(**changes)], runs=1
    )
    assert find_missing_assays(study, list(ASSAYS)) == {"evo+self-taught/A": []}
    innate = open_assay(tmp_path, "innate", "evo+self-taught/A")
    assert np.array_equal(
        innate.energy.sel(run=0, life="on"), study.read("evo+self-taught/A", 0).energy
    )


def test_a_study_without_runs_and_names_that_are_not_there_are_refused(
    study: StudyStore, tmp_path: Path
) -> None:
    empty = create_study(tmp_path, [make_small_experiment("evo")], seed=1)
    with pytest.raises(StudyError, match="holds no finished run yet"):
        find_missing_assays(empty, ["innate"])
    there = "there is no assay 'instinct'; there are innate, neutral, within-life, modules, reaction, descent"
    with pytest.raises(StudyError, match=there):
        find_missing_assays(study, ["innate", "instinct"])
    with pytest.raises(StudyError, match=there):
        open_assay(study.directory, "instinct", "evo/A")
    with pytest.raises(StudyError, match="has no condition 'evo/C'"):
        open_assay(study.directory, "innate", "evo/C")
    with pytest.raises(StudyError, match=r"`baldwinlab assay .* --assays innate` makes it"):
        open_assay(tmp_path, "innate", "evo/A")
    (tmp_path / "assays/innate/evo").mkdir(parents=True)
    (tmp_path / "assays/innate/evo/A.nc").write_bytes(b"no netCDF")
    with pytest.raises(StudyError, match=r"A.nc is damaged"):
        open_assay(tmp_path, "innate", "evo/A")


def test_where_the_study_is_gone_no_assay_is_written(tmp_path: Path) -> None:
    directory = tmp_path / "study"
    study = make_small_study(directory, conditions()[:1], runs=1)
    missing = find_missing_assays(study, ["innate"])
    (directory / "study.toml").unlink()
    with pytest.raises(FileNotFoundError, match="the study has been removed or moved while it ran"):
        run_assays(study, missing, 1, ignore_progress, ignore_message)
    assert not (directory / "assays").exists()
