"""Assays are reproducible and agree with the stored runs."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.backends import cpu
from baldwinlab.studies.assays import FROZEN, ON, Sample
from baldwinlab.studies.assays.catalog import get_assay, load_assays
from baldwinlab.studies.assays.fork import FORKS
from baldwinlab.studies.assays.results import find_missing_assays, open_assay
from baldwinlab.studies.assays.run import count_assay_steps, run_assays
from baldwinlab.studies.creation import create_study
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore
from tests.small_studies import (
    ignore_message,
    ignore_progress,
    make_small_study,
    read_records,
    shorten_preset,
)
from tests.studies.assays.studies import conditions, make_small_study_with_assays
from tests.studies.completion import complete_assays, count_progress, fail_without_space
from tests.worlds import make_small_experiment

ASSAYS_OF_ONE_SPECIES = [name for name in load_assays() if name != "opponents"]
NO_ASSAYS: dict[str, list[str]] = {experiment.name: [] for experiment in conditions()}


def stored(study: StudyStore) -> dict[str, bytes]:
    return read_records(study.directory / "assays")


def test_assays_have_the_declared_variables_and_attributes(study: StudyStore) -> None:
    for name in ASSAYS_OF_ONE_SPECIES:
        declared = load_assays()[name].variables
        assay = open_assay(study.directory, name, "evo+self-taught/A")
        assert set(assay.data_vars) == set(declared)
        for variable, meaning in declared.items():
            assert assay[variable].dims == meaning.dims
            assert assay[variable].dtype == meaning.dtype
        assert all(dim in assay.coords for dim in assay.dims)
        assert assay.run.values.tolist() == [0, 1, 2]
        further = {"control", "control_experiment"} if load_assays()[name].uses_control else set()
        further |= {"generations"} if name in FORKS.values() else set()
        assert {"condition", "seed", "experiment", "baldwinlab"} == set(assay.attrs) - further
        assert further <= set(assay.attrs)


@pytest.mark.nightly
def test_assays_are_identical_for_any_number_of_workers(study: StudyStore, tmp_path: Path) -> None:
    assert stored(make_small_study_with_assays(tmp_path / "one", workers=1)) == stored(study)
    assert stored(make_small_study_with_assays(tmp_path / "many", workers=7)) == stored(study)


@pytest.mark.parametrize(
    ("experiments", "generations"),
    [
        (conditions()[:2], None),
        # A fork simulates its control, and the neutral control learns in every generation.
        ([conditions()[1].replace(evolution={"generations": 12, "lamarckian_share": 0.5})], 2),
    ],
    ids=["learner and control", "Lamarckian learner"],
)
def test_progress_counts_every_agent_step(
    tmp_path: Path, experiments: list[Experiment], generations: int | None
) -> None:
    study = make_small_study(tmp_path, experiments, runs=2)
    done: list[int] = []
    missing = find_missing_assays(study, list(load_assays()))
    run_assays(study, missing, 2, count_progress(done), ignore_message, generations=generations)
    assert done[0] < 0
    assert sum(done) == 0


def test_all_simulated_experiments_are_compiled_in_advance(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    original_init = cpu.CpuBatch.__init__
    compiled = set[Any]()
    simulated = set[Any]()

    def record_init(
        self: cpu.CpuBatch, experiment: Experiment, *arguments: Any, **options: Any
    ) -> None:
        simulated.add(cpu.code_key(experiment))
        original_init(self, experiment, *arguments, **options)

    def warm_up(experiments: Iterable[Experiment], **options: Any) -> float:
        compiled.update(map(cpu.code_key, experiments))
        return 0.0

    monkeypatch.setattr("baldwinlab.studies.assays.run.compile_experiments", warm_up)
    monkeypatch.setattr(cpu.CpuBatch, "__init__", record_init)
    make_small_study_with_assays(tmp_path)
    assert simulated == compiled


def test_stored_assays_are_not_repeated(study: StudyStore) -> None:
    assert find_missing_assays(study, list(load_assays())) == NO_ASSAYS
    assert count_assay_steps(study, NO_ASSAYS) == 0


def test_outdated_and_damaged_assays_are_repeated(tmp_path: Path) -> None:
    study = make_small_study_with_assays(tmp_path, names=["modules", "descent"])
    complete = stored(study)
    make_small_study(tmp_path, conditions(), runs=4)
    study.path("evo/A", 3).unlink()
    damaged = tmp_path / "assays/descent/evo/A.nc"
    damaged.write_bytes(damaged.read_bytes()[:-200])
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
    assert stored(study)["descent/evo/A.nc"] == complete["descent/evo/A.nc"]


def test_an_error_does_not_change_stored_assays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = make_small_study_with_assays(tmp_path, names=["descent"])
    before = stored(study)
    monkeypatch.setattr(os, "fsync", fail_without_space)
    with pytest.raises(OSError, match="no space is left"):
        complete_assays(study, ["modules", "innate"], 2)
    assert stored(study) == before


@pytest.mark.nightly
def test_assays_do_not_depend_on_the_number_of_stored_genomes(
    study: StudyStore, tmp_path: Path
) -> None:
    thinned = [experiment.replace(record={"genome_every": 3}) for experiment in conditions()]
    make_small_study_with_assays(tmp_path, thinned)
    for name in ASSAYS_OF_ONE_SPECIES:
        condition = "evo+self-taught/B"
        complete = open_assay(study.directory, name, condition)
        assert complete.drop_attrs().identical(open_assay(tmp_path, name, condition).drop_attrs())


@pytest.mark.parametrize(
    "changes",
    [
        {"population": {"size": 1}, "lifetime": {"steps": 1}},
        {"world": {"food": []}, "evolution": {"generations": 1}},
        pytest.param({"network": {"hidden": [], "biases": True}}, marks=pytest.mark.nightly),
        {
            "learning": {
                "cost_per_step": 0.01,
                "cost_per_change": 0.1,
                "evolved_rate": True,
                "teacher": "fresh",
            }
        },
        {"evolution": {"lamarckian_share": 1.0}, "record": {"genome_every": 2}},
        pytest.param({"learning": {"control": "drift"}}, marks=pytest.mark.nightly),
    ],
)
def test_extreme_settings_can_be_assayed(tmp_path: Path, changes: dict[str, object]) -> None:
    study = make_small_study_with_assays(
        tmp_path, [make_small_experiment("evo+self-taught").replace(**changes)], runs=1
    )
    assert find_missing_assays(study, list(load_assays())) == {"evo+self-taught/A": []}
    innate = open_assay(tmp_path, "innate", "evo+self-taught/A")
    assert np.array_equal(
        innate.energy.sel(run=0, life="on"), study.read("evo+self-taught/A", 0).energy
    )


def test_studies_without_runs_and_unknown_names_are_refused(
    study: StudyStore, tmp_path: Path
) -> None:
    empty = create_study(tmp_path, [make_small_experiment("evo")], seed=1)
    with pytest.raises(StudyError, match="holds no finished run yet"):
        find_missing_assays(empty, ["innate"])
    unknown_assay = (
        "there is no assay 'instinct'; "
        "there are descent, innate, modules, neutral, reaction, within-life, assimilation, "
    )
    with pytest.raises(StudyError, match=unknown_assay):
        find_missing_assays(study, ["innate", "instinct"])
    with pytest.raises(StudyError, match=unknown_assay):
        open_assay(study.directory, "instinct", "evo/A")
    with pytest.raises(StudyError, match="has no condition 'evo/C'"):
        open_assay(study.directory, "innate", "evo/C")
    with pytest.raises(StudyError, match=r"`baldwinlab assay .* --assays innate` makes it"):
        open_assay(tmp_path, "innate", "evo/A")
    (tmp_path / "assays/innate/evo").mkdir(parents=True)
    (tmp_path / "assays/innate/evo/A.nc").write_bytes(b"no netCDF")
    with pytest.raises(StudyError, match=r"A.nc is damaged"):
        open_assay(tmp_path, "innate", "evo/A")


def test_no_assay_is_written_if_the_study_was_removed(tmp_path: Path) -> None:
    directory = tmp_path / "study"
    study = make_small_study(directory, conditions()[:1], runs=1)
    missing = find_missing_assays(study, ["innate"])
    (directory / "study.toml").unlink()
    with pytest.raises(FileNotFoundError, match="the study has been removed or moved while it ran"):
        run_assays(study, missing, 1, ignore_progress, ignore_message)
    assert not (directory / "assays").exists()


N_AGENTS = 6
N_RUNS = 2


@pytest.fixture(scope="module")
def sample(tmp_path_factory: pytest.TempPathFactory) -> Sample:
    experiment = shorten_preset().replace(
        population={"size": N_AGENTS, "worlds": 3}, lifetime={"repeats": 2}
    )
    study = make_small_study(tmp_path_factory.mktemp("several") / "study", [experiment], N_RUNS)
    return Sample(
        directory=study.directory,
        seed=study.seed,
        experiment=experiment,
        runs=tuple(range(N_RUNS)),
        records=[study.record(experiment.name, run) for run in range(N_RUNS)],
        other_maps=(),
        report_progress=lambda amount: None,
    )


def test_assays_have_the_stored_fitness_and_the_first_lifetime_in_windows(sample: Sample) -> None:
    innate = get_assay("innate").measure(sample)
    learned = innate["energy"][:, -1, ON]
    # `simulate_as_evolved` raises an error for another fitness than the stored one.
    assert np.array_equal(learned, sample.energy(2))
    assert np.isfinite(innate["energy"][:, :, FROZEN]).all()
    # Reaction norms have the stored fitness in the unchanged setting.
    energy = get_assay("reaction").measure(sample)["energy"]
    assert np.array_equal(energy[:, 0], sample.energy(2))
    # Windows within the lifetime are those of the first lifetime.
    within_life = get_assay("within-life").measure(sample)
    n_newborns = 4
    assert within_life["eaten_in_window"].shape == (N_RUNS, n_newborns, 2, N_AGENTS)
    assert within_life["first_meal"].shape == (N_RUNS, n_newborns, N_AGENTS)
