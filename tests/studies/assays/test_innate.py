"""Innate and learned, against lives whose outcome is known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from baldwinlab.papers.presets import load
from baldwinlab.simulation.reevaluation import reevaluate
from baldwinlab.studies.assays.innate import (
    assayed_generations,
    drift_generations,
    layer_names,
    weight_distances,
)
from baldwinlab.studies.assays.results import find_missing_assays, open_assay
from baldwinlab.studies.assays.run import run_assays
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore
from tests.small_studies import ignore_message, ignore_progress, make_small_study
from tests.studies.assays.studies import measured
from tests.worlds import make_small_experiment


def test_life_with_learning_on_is_the_life_that_was_lived(study: StudyStore) -> None:
    for condition in ("evo+self-taught/A", "self-taught/A", "evo+self-taught/B"):
        found = open_assay(study.directory, "innate", condition)
        for run in range(3):
            assert np.array_equal(
                found.energy.sel(run=run, life="on"), study.read(condition, run).energy
            )


def test_what_learning_made_of_the_weights_is_how_the_frozen_live(study: StudyStore) -> None:
    condition = "evo+self-taught/A"
    found, record = (
        open_assay(study.directory, "innate", condition).sel(run=1, generation=2),
        study.read(condition, 1),
    )
    experiment = study.experiments[condition]
    died = reevaluate(experiment, study.seed, [1], 2, record.genome.values[None, 2]).weights
    frozen = reevaluate(
        experiment.replace(learning={"rule": "none"}), study.seed, [1], 2, died[:, :, None]
    )
    assert np.array_equal(found.energy.sel(life="frozen"), frozen.energy[0])
    assert (found.distance > 0).any()
    assert not np.array_equal(found.energy.sel(life="off"), found.energy.sel(life="on"))


def test_drift_is_a_life_of_its_own_in_the_generations_that_are_chosen_for_it(
    tmp_path: Path,
) -> None:
    experiment = make_small_experiment(
        "evo+self-taught", evolution={"generations": 12}, learning={"rate": 0.5}
    )
    study = measured(tmp_path, [experiment], ["innate"], runs=1)
    found = open_assay(tmp_path, "innate", experiment.name).energy.sel(run=0)
    lived = found.sel(life="drift").notnull().all("agent")
    assert found.generation[lived].values.tolist() == [0, 2, 4, 6, 8, 10, 11]
    drift = experiment.replace(learning={"rule": "drift"})
    genomes = study.read(experiment.name, 0).genome.values[None, 11]
    assert np.array_equal(
        found.sel(generation=11, life="drift"),
        reevaluate(drift, study.seed, [0], 11, genomes).energy[0],
    )
    assert not np.array_equal(
        found.sel(generation=11, life="drift"), found.sel(generation=11, life="on")
    )


def test_agents_that_do_not_learn_have_one_kind_of_life(study: StudyStore) -> None:
    found = open_assay(study.directory, "innate", "evo/A")
    assert np.array_equal(found.energy.sel(run=2, life="off"), study.read("evo/A", 2).energy)
    assert found.energy.sel(life=["on", "frozen", "drift"]).isnull().all()
    assert found.distance.isnull().all()


def test_learning_at_rate_0_makes_no_difference_and_moves_nothing(tmp_path: Path) -> None:
    measured(tmp_path, [make_small_experiment("evo+self-taught", learning={"rate": 0})], ["innate"])
    found = open_assay(tmp_path, "innate", "evo+self-taught/A")
    for life in ("off", "frozen", "drift"):
        assert np.array_equal(found.energy.sel(life=life), found.energy.sel(life="on"))
    assert (found.distance == 0).all()
    assert found.energy.sum() > 0


def test_on_map_b_nothing_is_innate(tmp_path: Path) -> None:
    whole_lives = [
        load(f"{condition}/B").replace(evolution={"generations": 3})
        for condition in ("evo", "evo+self-taught")
    ]
    measured(tmp_path, whole_lives, ["innate"])
    assert (open_assay(tmp_path, "innate", "evo/B").energy.sel(life="off") == 0).all()
    learners = open_assay(tmp_path, "innate", "evo+self-taught/B").energy
    assert (learners.sel(life="off") == 0).all()
    assert learners.sel(life="on").sum() > 0


def test_a_record_that_other_code_made_is_refused(tmp_path: Path) -> None:
    study = make_small_study(tmp_path, [make_small_experiment("evo+self-taught")], runs=2)
    record = study.read("evo+self-taught/A", 1)
    record.energy[1, 4] += 1
    study.write("evo+self-taught/A", 1, record)
    with pytest.raises(
        StudyError, match=r"0001.nc: generation 1, simulated again, does not eat the stored amount"
    ):
        run_assays(
            study, find_missing_assays(study, ["innate"]), 1, ignore_progress, ignore_message
        )


def test_distances_are_those_of_each_layer() -> None:
    experiment = make_small_experiment("evo+self-taught", network={"hidden": [2], "biases": True})
    birth = np.zeros((5, 17), np.float32)
    death = birth.copy()
    death[:, [0, 7]] = 3, 4  # a weight and a bias of the first layer
    death[2, [8, 16]] = 6, 8  # a weight and a bias of the second
    assert np.array_equal(weight_distances(experiment, birth, death), [[5] * 5, [0, 0, 10, 0, 0]])


@pytest.mark.parametrize(
    ("hidden", "names"),
    [
        ([], ["sensors to actions"]),
        ([4], ["sensors to hidden", "hidden to actions"]),
        ([4, 2], ["sensors to hidden 1", "hidden 1 to hidden 2", "hidden 2 to actions"]),
    ],
)
def test_layers_are_named_by_what_they_connect(hidden: list[int], names: list[str]) -> None:
    assert layer_names(make_small_experiment("evo", network={"hidden": hidden})) == names


@pytest.mark.parametrize("count", [1, 2, 50, 51, 100, 1000, 12345])
def test_long_evolution_is_thinned_with_its_first_and_last_generation(count: int) -> None:
    found = assayed_generations(make_small_experiment("evo", evolution={"generations": count}))
    assert {0, count - 1} <= set(found)
    assert found == sorted(set(found))
    assert min(count, 51) <= len(found) <= 101
    alike = assayed_generations(
        make_small_experiment("self-taught", evolution={"generations": count})
    )
    assert {0, count - 1} <= set(alike)
    assert len(alike) <= 11
    control = drift_generations(make_small_experiment("evo", evolution={"generations": count}))
    assert {0, count - 1} <= set(control) <= set(found)
    assert min(count, 6) <= len(control) <= 11


@pytest.mark.parametrize(
    ("rule", "fits"),
    [("self-taught", True), ("drift", True), ("crbp", False), ("hebb", False), ("none", True)],
)
def test_drift_is_lived_where_it_goes_as_far_as_what_it_stands_in_for(
    rule: str, fits: bool
) -> None:
    assert bool(drift_generations(make_small_experiment("evo", learning={"rule": rule}))) == fits
