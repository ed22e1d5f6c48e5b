"""Assays of evolved genomes under changed settings, or with random modules."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.experiment import Experiment
from baldwinlab.simulation.reevaluation import reevaluate
from baldwinlab.studies.assays.catalog import get_assay
from baldwinlab.studies.assays.reaction import (
    LEARNING_FACTORS,
    assayed_generations,
    list_settings,
    scale_learning,
)
from baldwinlab.studies.assays.results import open_assay
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore
from tests.studies.assays.studies import make_small_study_with_assays
from tests.worlds import make_small_experiment


def assayed_energy(study: StudyStore, condition: str, field: str, value: str) -> Any:
    assay = open_assay(study.directory, "reaction", condition)
    return assay.energy.isel(
        setting=((assay.field == field) & (assay.value == value)).values
    ).squeeze("setting", drop=True)


def simulated_energy(study: StudyStore, condition: str, experiment: Experiment) -> Any:
    genomes = np.stack([study.read(condition, run).genome.values[-1] for run in range(3)])
    return reevaluate(experiment, study.seed, range(3), 2, genomes).energy


def test_the_unchanged_setting_gives_the_stored_energy(study: StudyStore) -> None:
    for condition in study.experiments:
        stored = [study.read(condition, run).energy[-1] for run in range(3)]
        assert np.array_equal(assayed_energy(study, condition, "as evolved", ""), stored)


def test_agents_are_assayed_on_the_second_map_of_the_study(study: StudyStore) -> None:
    condition = "evo+self-taught/A"
    on_map_b = study.experiments[condition].replace(
        world=study.experiments["evo+self-taught/B"].world
    )
    assert np.array_equal(
        assayed_energy(study, condition, "map", "your map 2"),
        simulated_energy(study, condition, on_map_b),
    )
    assay = open_assay(study.directory, "reaction", "evo/A")
    # The study has a single map for the condition `evo`.
    assert "map" not in assay.field.values


def test_a_learning_rate_of_0_gives_the_innate_energy(study: StudyStore) -> None:
    condition = "evo+self-taught/B"
    innate = open_assay(study.directory, "innate", condition).energy.sel(life="off")
    last = innate.isel(generation=-1)
    assert np.array_equal(assayed_energy(study, condition, "learning.rate", "0"), last)


def test_each_setting_changes_a_single_field(study: StudyStore) -> None:
    condition = "evo/A"
    short_sighted = study.experiments[condition].replace(senses={"visual_radius": 10})
    assert np.array_equal(
        assayed_energy(study, condition, "senses.visual_radius", "10"),
        simulated_energy(study, condition, short_sighted),
    )
    more_food = assayed_energy(study, condition, "world.food.0.count", "48")
    assert more_food.sum() > assayed_energy(study, condition, "as evolved", "").sum()


def setting_values(experiment: Experiment) -> list[tuple[str, str]]:
    return [(setting.field, setting.value) for setting in list_settings(experiment, maps=())]


def test_invalid_settings_are_not_assayed() -> None:
    assert setting_values(make_small_experiment("evo")) == [
        ("as evolved", ""),
        *(("world.food.0.count", count) for count in ("3", "6", "24", "48")),
        # A radius of 80 is invalid because it is more than half the map.
        *(("senses.visual_radius", radius) for radius in ("10", "20")),
    ]


@pytest.mark.parametrize(("count", "counts"), [(0, []), (1, ["0", "2", "4"])])
def test_settings_without_effect_are_not_assayed(count: int, counts: list[str]) -> None:
    food = [{"x": [20, 100], "y": [10, 90], "count": count}]
    learner = make_small_experiment("evo+self-taught", world={"food": food}, learning={"rate": 5})
    settings = setting_values(learner)
    assert [value for field, value in settings if field == "world.food.0.count"] == counts
    # A learning rate of 50 is invalid.
    assert [value for field, value in settings if field == "learning.rate"] == ["0", "0.5"]


LEARNER = "evo+self-taught/A"


def test_a_factor_multiplies_the_learning_rate(study: StudyStore) -> None:
    energy = open_assay(study.directory, "reaction-norms", LEARNER).energy
    experiment = study.experiments[LEARNER]
    for generation in (0, 2):
        stored = [study.read(LEARNER, run).genome.values[generation] for run in range(3)]
        for factor in (0.25, 2.0):
            changed = experiment.replace(learning={"rate": 0.5 * factor})
            repeated = reevaluate(changed, study.seed, range(3), generation, np.stack(stored))
            assayed = energy.sel(generation=generation, factor=factor)
            assert np.array_equal(assayed, repeated.energy)
    # The factors 0 and 1 are innate and learned fitness.
    innate = open_assay(study.directory, "innate", LEARNER).energy
    assert energy.factor.values.tolist() == list(LEARNING_FACTORS)
    for factor, life in ((0, "off"), (1, "on")):
        assert np.array_equal(energy.sel(factor=factor), innate.sel(life=life))


@pytest.mark.parametrize(
    ("n_generations", "expected"),
    [(1, [0]), (2, [0, 1]), (3, [0, 1, 2]), (31, [0, 10, 20, 30]), (100, [0, 33, 66, 99])],
)
def test_four_generations_have_equal_distances(n_generations: int, expected: list[int]) -> None:
    experiment = make_small_experiment("evo").replace(evolution={"generations": n_generations})
    assert assayed_generations(experiment) == expected


def test_the_settings_are_those_of_the_generation_in_a_schedule() -> None:
    changes = [{"generation": 2, "learning": {"rate": 0.4}}]
    experiment = make_small_experiment("evo+self-taught", learning={"rate": 0.1}, schedule=changes)
    rates = [scale_learning(experiment, generation, 2.0) for generation in (0, 2)]
    assert [rate.learning.rate for rate in rates if rate] == [0.2, 0.8]


@pytest.mark.parametrize(
    ("condition", "factor", "setting", "expected"),
    [
        ("hinton-nowlan-1987:guessing", 0.25, "trials", 250),
        ("mayley-1996:climbing/smooth", 0.25, "trials", 8),
        ("paenke-2007:stepping/convex", 4.0, "learning_step", 1.2),
    ],
)
def test_models_declare_what_a_factor_multiplies(
    condition: str, factor: float, setting: str, expected: float
) -> None:
    changed = scale_learning(bl.load(condition), 0, factor)
    assert changed is not None
    assert getattr(changed.model_part, setting) == pytest.approx(expected)


def test_a_number_of_trials_that_rounds_to_0_is_learning_off() -> None:
    experiment = bl.load("mayley-1996:climbing/smooth").replace(nk_climbers={"trials": 1})
    assert scale_learning(experiment, 0, 0.25) == experiment.without_learning()


def test_an_invalid_amount_of_learning_has_no_fitness(tmp_path: Path) -> None:
    condition = bl.load("todd-miller-1991:hebbian/smell-55").replace(
        population={"size": 10}, evolution={"generations": 2}, cue_learners={"learning_rate": 1.5}
    )
    study = bl.run([condition], runs=1, seed=1, out=tmp_path / "study", workers=1)
    energy = study.assay("reaction-norms", condition.name, workers=1).energy
    is_defined = energy.notnull().all(("run", "generation", "agent"))
    # A rate above 2 is not valid.
    assert is_defined.values.tolist() == [True, True, True, True, False, False]


@pytest.mark.parametrize(
    ("condition", "reason"),
    [
        ("evo/A", "needs a condition that learns"),
        ("soltoggio-2008:modulated-plasticity/single", "the model t-mazes of .* declares none"),
    ],
)
def test_conditions_without_an_amount_of_learning_are_refused(condition: str, reason: str) -> None:
    experiment = bl.load(condition)
    assert re.search(reason, get_assay("reaction-norms").find_obstacle(experiment))


def test_two_evolved_modules_give_the_stored_energy(study: StudyStore) -> None:
    for condition in ("evo+self-taught/A", "self-taught/A", "evo+self-taught/B"):
        energy = open_assay(study.directory, "modules", condition).energy.sel(
            modules="both evolved"
        )
        assert np.array_equal(energy, [study.read(condition, run).energy[-1] for run in range(3)])


def test_the_reinforcement_module_has_no_effect_at_a_learning_rate_of_0(tmp_path: Path) -> None:
    make_small_study_with_assays(
        tmp_path, [make_small_experiment("evo+self-taught", learning={"rate": 0})], ["modules"]
    )
    energy = open_assay(tmp_path, "modules", "evo+self-taught/A").energy
    evolved = energy.sel(modules="both evolved")
    random = energy.sel(modules="both random")
    assert np.array_equal(energy.sel(modules="random reinforcement, evolved action"), evolved)
    assert np.array_equal(energy.sel(modules="evolved reinforcement, random action"), random)
    assert not np.array_equal(evolved, random)


def test_the_assay_refuses_agents_with_a_single_module(study: StudyStore) -> None:
    message = r"evo/A.nc does not exist: the assay modules needs agents with a reinforcement module"
    with pytest.raises(StudyError, match=message):
        open_assay(study.directory, "modules", "evo/A")
