"""Reaction norms: what the last generation eats under circumstances that it did not evolve in, one of them changed at a time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.core.variables import AS_EVOLVED
from baldwinlab.experiment import Experiment, ExperimentError, assign
from baldwinlab.studies.assays.sample import Conditions, OnMap, Sample

FOOD_FACTORS = (0.25, 0.5, 2, 4)  # times as much food
RADIUS_FACTORS = (0.25, 0.5, 2)  # times as far a view
RATE_FACTORS = (0, 0.1, 10)  # times as fast learning


class Setting(NamedTuple):
    """A changed circumstance."""

    field: str  # the path of what is changed, "map" for the whole world
    value: str
    experiment: Experiment


def coordinates(study: Conditions, condition: str) -> Mapping[str, Any]:
    found = settings(study.experiments[condition], other_maps(study, condition))
    named = {
        name: ("setting", [getattr(setting, name) for setting in found])
        for name in ("field", "value")
    }
    return {"setting": np.arange(len(found), dtype=np.int32), **named}


def count_lives(study: Conditions, condition: str) -> int:
    return len(settings(study.experiments[condition], other_maps(study, condition)))


def measure(sample: Sample) -> Mapping[str, npt.NDArray[Any]]:
    """`energy` [run, setting, agent]."""
    last = sample.experiment.evolution.generations - 1
    genomes = sample.genomes(last)
    _, *others = settings(sample.experiment, sample.elsewhere)
    found = [sample.simulate_as_evolved(last, genomes)]
    found += [sample.simulate(setting.experiment, last, genomes) for setting in others]
    return {"energy": np.stack([lives.energy for lives in found], axis=1)}


def settings(experiment: Experiment, elsewhere: Sequence[OnMap]) -> list[Setting]:
    """The settings of a condition: first as it evolved, then each that is possible and differs."""
    found = [Setting(AS_EVOLVED, "", experiment)]
    other_maps = (Setting("map", name, there) for name, there in elsewhere)
    for setting in (*other_maps, *_other_values(experiment)):
        if all(setting.experiment != known.experiment for known in found):
            found.append(setting)
    return found


def other_maps(study: Conditions, condition: str) -> tuple[OnMap, ...]:
    """A condition in the worlds of the study's conditions of the same learner on other maps."""
    experiment, own = study.experiments[condition], study.factors[condition]
    found: list[OnMap] = []
    for other, there in study.factors.items():
        if own.map and there.map and there.learner == own.learner:
            on_map = there.map, experiment.replace(world=study.experiments[other].world)
            found += [on_map] if on_map[1] != experiment and on_map not in found else []
    return tuple(found)


def _other_values(experiment: Experiment) -> Iterator[Setting]:
    """Fields times some factors; without those that the experiment refuses."""
    fields: dict[str, list[float]] = {}
    for number, region in enumerate(experiment.world.food):
        fields[f"world.food.{number}.count"] = [
            round(factor * region.count) for factor in FOOD_FACTORS
        ]
    fields["senses.visual_radius"] = [
        factor * experiment.senses.visual_radius for factor in RADIUS_FACTORS
    ]
    if experiment.learns:
        fields["learning.rate"] = [factor * experiment.learning.rate for factor in RATE_FACTORS]
    for field, values in fields.items():
        for value in values:
            try:
                yield Setting(field, f"{value:g}", assign(experiment, [f"{field}={value}"]))
            except ExperimentError:
                continue
