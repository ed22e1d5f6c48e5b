"""The assay `reaction` measures reaction norms: the energy under changed settings."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from baldwinlab.experiment import Experiment
from baldwinlab.simulation.reevaluation import reevaluate
from baldwinlab.studies.assays.reaction import list_settings
from baldwinlab.studies.assays.results import open_assay
from baldwinlab.studies.store import StudyStore
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
