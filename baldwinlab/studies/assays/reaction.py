"""Assay of changed settings: performance of the last generation under one changed setting."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final, NamedTuple

import numpy as np

from baldwinlab.experiment import Experiment, ExperimentError, assign
from baldwinlab.studies.assays import (
    SIMULATION_OBSTACLES,
    Arrays,
    Assay,
    AssayPlan,
    Conditions,
    OnMap,
    Sample,
    declare_fitness,
    find_model_obstacle,
    list_other_maps,
    select_last_settings,
)

# Name of the unchanged setting.
UNCHANGED_SETTING = "as evolved"
# Factors by which the number of items, the visual radius and the learning rate are multiplied.
ITEM_COUNT_FACTORS = (0.25, 0.5, 2, 4)
VISUAL_RADIUS_FACTORS = (0.25, 0.5, 2)
LEARNING_RATE_FACTORS = (0, 0.1, 10)


class ChangedSetting(NamedTuple):
    """An experiment with one changed setting."""

    field: str  # Path of the changed field, or "map".
    value: str  # Name of the map, or the changed number as text.
    experiment: Experiment


def plan_assay(study: Conditions, condition: str) -> AssayPlan:
    all_settings = list_settings(study.experiments[condition], list_other_maps(study, condition))
    coordinates = {
        "setting": np.arange(len(all_settings), dtype=np.int32),
        "field": ("setting", [setting.field for setting in all_settings]),
        "value": ("setting", [setting.value for setting in all_settings]),
    }
    return AssayPlan(coordinates, len(all_settings))


def measure(sample: Sample) -> Arrays:
    """Measure `energy` [run, setting, agent]."""
    last_generation = sample.experiment.evolution.generations - 1
    genomes = sample.genomes(last_generation)
    # The first setting is unchanged, so its energy is checked against the stored energy.
    _, *changed_settings = list_settings(sample.experiment, sample.other_maps)
    outcomes = [sample.simulate_as_evolved(last_generation, genomes)]
    for setting in changed_settings:
        outcomes.append(sample.simulate(setting.experiment, last_generation, genomes))
    return {"energy": np.stack([lives.energy for lives in outcomes], axis=1)}


def list_settings(experiment: Experiment, maps: Sequence[OnMap]) -> list[ChangedSetting]:
    """Return the settings of the last generation, unchanged and then with each distinct change."""
    experiment = select_last_settings(experiment)
    distinct = [ChangedSetting(UNCHANGED_SETTING, "", experiment)]
    map_changes = (ChangedSetting("map", name, on_map) for name, on_map in maps)
    for setting in (*map_changes, *_scale_settings(experiment)):
        if all(setting.experiment != earlier.experiment for earlier in distinct):
            distinct.append(setting)
    return distinct


def _scale_settings(experiment: Experiment) -> Iterator[ChangedSetting]:
    """Yield the settings with one scaled value. Values that are not valid are omitted."""
    fields: dict[str, list[float]] = {}
    for region_index, region in enumerate(experiment.world.food):
        fields[f"world.food.{region_index}.count"] = [
            round(factor * region.count) for factor in ITEM_COUNT_FACTORS
        ]
    fields["senses.visual_radius"] = [
        factor * experiment.senses.visual_radius for factor in VISUAL_RADIUS_FACTORS
    ]
    if experiment.learns:
        fields["learning.rate"] = [
            factor * experiment.learning.rate for factor in LEARNING_RATE_FACTORS
        ]
    for field, values in fields.items():
        for value in values:
            try:
                changed = assign(experiment, [f"{field}={value}"])
            except ExperimentError:
                continue
            yield ChangedSetting(field, f"{value:g}", changed)


ASSAY: Final = Assay(
    name="reaction",
    question="How does fitness change if one setting changes?",
    variables={
        "energy": declare_fitness(("setting", "agent"), "fitness in this setting"),
    },
    plan=plan_assay,
    measure=measure,
    obstacles=(*SIMULATION_OBSTACLES, find_model_obstacle),
    is_default=True,
    uses_other_maps=True,
)
