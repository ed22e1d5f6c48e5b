"""The assay `innate`, compared with lifetimes that have a known result."""

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
from baldwinlab.studies.assays.results import open_assay
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore
from tests.small_studies import make_small_study
from tests.studies.assays.studies import make_small_study_with_assays
from tests.studies.completion import complete_assays
from tests.worlds import make_small_experiment


def test_lifetimes_with_learning_on_equal_the_stored_lifetimes(study: StudyStore) -> None:
    for condition in ("evo+self-taught/A", "self-taught/A", "evo+self-taught/B"):
        assay = open_assay(study.directory, "innate", condition)
        for run in range(3):
            assert np.array_equal(
                assay.energy.sel(run=run, life="on"), study.read(condition, run).energy
            )


def test_frozen_lifetimes_use_the_learned_weights(study: StudyStore) -> None:
    condition = "evo+self-taught/A"
    assay = open_assay(study.directory, "innate", condition).sel(run=1, generation=2)
    record = study.read(condition, 1)
    experiment = study.experiments[condition]
    weights_at_death = reevaluate(
        experiment, study.seed, [1], 2, record.genome.values[None, 2]
    ).weights
    frozen = reevaluate(
        experiment.replace(learning={"rule": "none"}),
        study.seed,
        [1],
        2,
        weights_at_death[:, :, None],
    )
    assert np.array_equal(assay.energy.sel(life="frozen"), frozen.energy[0])
    assert (assay.distance > 0).any()
    assert not np.array_equal(assay.energy.sel(life="off"), assay.energy.sel(life="on"))


def test_the_drift_control_is_simulated_in_selected_generations(tmp_path: Path) -> None:
    experiment = make_small_experiment(
        "evo+self-taught", evolution={"generations": 12}, learning={"rate": 0.5}
    )
    study = make_small_study_with_assays(tmp_path, [experiment], ["innate"], runs=1)
    energy = open_assay(tmp_path, "innate", experiment.name).energy.sel(run=0)
    is_measured = energy.sel(life="drift").notnull().all("agent")
    assert energy.generation[is_measured].values.tolist() == [0, 2, 4, 6, 8, 10, 11]
    drift = experiment.replace(learning={"control": "drift"})
    genomes = study.read(experiment.name, 0).genome.values[None, 11]
    expected = reevaluate(drift, study.seed, [0], 11, genomes).energy[0]
    last = energy.sel(generation=11)
    assert np.array_equal(last.sel(life="drift"), expected)
    assert not np.array_equal(last.sel(life="drift"), last.sel(life="on"))


def test_agents_without_learning_have_only_lifetimes_with_learning_off(study: StudyStore) -> None:
    assay = open_assay(study.directory, "innate", "evo/A")
    assert np.array_equal(assay.energy.sel(run=2, life="off"), study.read("evo/A", 2).energy)
    assert assay.energy.sel(life=["on", "frozen", "drift"]).isnull().all()
    assert assay.distance.isnull().all()


def test_a_learning_rate_of_0_changes_neither_energy_nor_weights(tmp_path: Path) -> None:
    make_small_study_with_assays(
        tmp_path, [make_small_experiment("evo+self-taught", learning={"rate": 0})], ["innate"]
    )
    assay = open_assay(tmp_path, "innate", "evo+self-taught/A")
    for life in ("off", "frozen", "drift"):
        assert np.array_equal(assay.energy.sel(life=life), assay.energy.sel(life="on"))
    assert (assay.distance == 0).all()
    assert assay.energy.sum() > 0


def test_innate_energy_is_zero_on_map_b(tmp_path: Path) -> None:
    experiments = [
        load(f"{condition}/B").replace(evolution={"generations": 3})
        for condition in ("evo", "evo+self-taught")
    ]
    make_small_study_with_assays(tmp_path, experiments, ["innate"])
    assert (open_assay(tmp_path, "innate", "evo/B").energy.sel(life="off") == 0).all()
    learners = open_assay(tmp_path, "innate", "evo+self-taught/B").energy
    assert (learners.sel(life="off") == 0).all()
    assert learners.sel(life="on").sum() > 0


def test_a_record_that_differs_from_its_simulation_is_refused(tmp_path: Path) -> None:
    study = make_small_study(tmp_path, [make_small_experiment("evo+self-taught")], runs=2)
    record = study.read("evo+self-taught/A", 1)
    record.energy[1, 4] += 1
    study.write("evo+self-taught/A", 1, record)
    with pytest.raises(
        StudyError, match=r"0001.nc: generation 1, simulated again, does not eat the stored amount"
    ):
        complete_assays(study, ["innate"])


def test_weight_distances_are_computed_per_layer() -> None:
    experiment = make_small_experiment("evo+self-taught", network={"hidden": [2], "biases": True})
    birth = np.zeros((5, 17), np.float32)
    death = birth.copy()
    # A weight and a bias of the first layer.
    death[:, [0, 7]] = 3, 4
    # A weight and a bias of the second layer.
    death[2, [8, 16]] = 6, 8
    assert np.array_equal(weight_distances(experiment, birth, death), [[5] * 5, [0, 0, 10, 0, 0]])


@pytest.mark.parametrize(
    ("hidden", "names"),
    [
        ([], ["sensors to actions"]),
        ([4], ["sensors to hidden", "hidden to actions"]),
        ([4, 2], ["sensors to hidden 1", "hidden 1 to hidden 2", "hidden 2 to actions"]),
    ],
)
def test_the_name_of_a_layer_contains_the_units_that_it_connects(
    hidden: list[int], names: list[str]
) -> None:
    assert layer_names(make_small_experiment("evo", network={"hidden": hidden})) == names


@pytest.mark.parametrize("count", [1, 2, 50, 51, 100, 1000, 12345])
def test_the_assay_samples_generations_including_the_first_and_the_last(count: int) -> None:
    generations = assayed_generations(
        make_small_experiment("evo", evolution={"generations": count})
    )
    assert {0, count - 1} <= set(generations)
    assert generations == sorted(set(generations))
    assert min(count, 51) <= len(generations) <= 101
    unchanged = assayed_generations(
        make_small_experiment("self-taught", evolution={"generations": count})
    )
    assert {0, count - 1} <= set(unchanged)
    assert len(unchanged) <= 11
    control = drift_generations(make_small_experiment("evo", evolution={"generations": count}))
    assert {0, count - 1} <= set(control) <= set(generations)
    assert min(count, 6) <= len(control) <= 11


@pytest.mark.parametrize(
    ("rule", "applies"),
    [("self-taught", True), ("crbp", False), ("hebb", False), ("none", True)],
)
def test_the_drift_control_applies_only_to_rules_that_support_it(rule: str, applies: bool) -> None:
    assert bool(drift_generations(make_small_experiment("evo", learning={"rule": rule}))) == applies
