"""Reaction norms: settings that are known, and settings that cannot be."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from baldwinlab.experiment import Experiment
from baldwinlab.simulation.reevaluation import reevaluate
from baldwinlab.studies.assays.reaction_norms import list_settings
from baldwinlab.studies.assays.results import open_assay
from baldwinlab.studies.store import StudyStore
from tests.worlds import make_small_experiment


def energy_in(study: StudyStore, condition: str, field: str, value: str) -> Any:
    found = open_assay(study.directory, "reaction", condition)
    return found.energy.isel(
        setting=((found.field == field) & (found.value == value)).values
    ).squeeze("setting", drop=True)


def last_lives(study: StudyStore, condition: str, experiment: Experiment) -> Any:
    genomes = np.stack([study.read(condition, run).genome.values[-1] for run in range(3)])
    return reevaluate(experiment, study.seed, range(3), 2, genomes).energy


def test_in_the_setting_in_which_they_evolved_they_live_as_they_did(study: StudyStore) -> None:
    for condition in study.experiments:
        stored = [study.read(condition, run).energy[-1] for run in range(3)]
        assert np.array_equal(energy_in(study, condition, "as evolved", ""), stored)


def test_on_the_other_map_they_find_its_food(study: StudyStore) -> None:
    condition = "evo+self-taught/A"
    moved = study.experiments[condition].replace(world=study.experiments["evo+self-taught/B"].world)
    assert np.array_equal(
        energy_in(study, condition, "map", "B"), last_lives(study, condition, moved)
    )
    found = open_assay(study.directory, "reaction", "evo/A")
    assert "map" not in found.field.values  # of evo, the study has one map


def test_without_learning_only_what_is_innate_is_left(study: StudyStore) -> None:
    condition = "evo+self-taught/B"
    innate = (
        open_assay(study.directory, "innate", condition).energy.sel(life="off").isel(generation=-1)
    )
    assert np.array_equal(energy_in(study, condition, "learning.rate", "0"), innate)


def test_fields_are_changed_one_at_a_time(study: StudyStore) -> None:
    condition = "evo/A"
    near = study.experiments[condition].replace(senses={"visual_radius": 10})
    assert np.array_equal(
        energy_in(study, condition, "senses.visual_radius", "10"),
        last_lives(study, condition, near),
    )
    assert (
        energy_in(study, condition, "world.food.0.count", "48").sum()
        > energy_in(study, condition, "as evolved", "").sum()
    )


def values(experiment: Experiment) -> list[tuple[str, str]]:
    return [(setting.field, setting.value) for setting in list_settings(experiment, maps=())]


def test_what_the_experiment_refuses_is_left_out() -> None:
    assert values(make_small_experiment("evo")) == [
        ("as evolved", ""),
        *(("world.food.0.count", count) for count in ("3", "6", "24", "48")),
        *(
            ("senses.visual_radius", radius) for radius in ("10", "20")
        ),  # 80 would be more than half the map
    ]


@pytest.mark.parametrize(("count", "others"), [(0, []), (1, ["0", "2", "4"])])
def test_what_makes_no_difference_is_left_out(count: int, others: list[str]) -> None:
    food = [{"x": [20, 100], "y": [10, 90], "count": count}]
    learner = make_small_experiment("evo+self-taught", world={"food": food}, learning={"rate": 5})
    found = values(learner)
    assert [value for field, value in found if field == "world.food.0.count"] == others
    assert [value for field, value in found if field == "learning.rate"] == [
        "0",
        "0.5",
    ]  # 50 would be too fast
