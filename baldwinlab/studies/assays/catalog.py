"""Catalog of the assays, and the experiments to which each applies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final, Protocol

import numpy.typing as npt

from baldwinlab.core.assay_variables import FORKS, OPPONENTS, UNSEEN_MAPS
from baldwinlab.evolution import find_archive_fitness
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.experiment.controls import find_control
from baldwinlab.studies.assays import (
    canalization,
    descent,
    fork,
    innate,
    modules,
    neutral,
    opponents,
    reaction,
    reaction_norms,
    unseen_maps,
    within_life,
)
from baldwinlab.studies.assays.sample import Conditions, Sample
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.run_samples import sample_runs
from baldwinlab.studies.store import StudyStore

Arrays = Mapping[str, npt.NDArray[Any]]


class Assay(Protocol):
    """Module of an assay."""

    def coordinates(self, study: Conditions, condition: str) -> Mapping[str, Any]:
        """Return the coordinates of the dataset except `run` and `agent`."""

    def count_lives(self, study: Conditions, condition: str) -> int:
        """Return the number of simulated generations per run."""

    def measure(self, sample: Sample) -> Arrays:
        """Return the variables that `ASSAY_VARIABLES` declares."""


ASSAYS: Mapping[str, Assay] = {
    "innate": innate,
    "neutral": neutral,
    "within-life": within_life,
    "modules": modules,
    "reaction": reaction,
    "descent": descent,
    "reaction-norms": reaction_norms,
    "canalization": canalization,
    OPPONENTS: opponents,
    UNSEEN_MAPS: unseen_maps,
} | {name: fork.Fork(start) for name, start in FORKS.items()}

# The assays that a command measures only if it names them.
NAMED_ASSAYS: Final = ("reaction-norms", "canalization", OPPONENTS, UNSEEN_MAPS, *FORKS)
DEFAULT_ASSAYS: Final = tuple(name for name in ASSAYS if name not in NAMED_ASSAYS)


def get_assay(name: str, generations: int) -> Assay:
    """Return an assay, with branches of this number of generations if it is a fork."""
    return fork.Fork(FORKS[name], generations) if name in FORKS else ASSAYS[name]


def why_not_applicable(name: str, condition: str, experiments: Mapping[str, BaseExperiment]) -> str:
    """Return a sentence that says why an assay is not applicable; "" if it is applicable."""
    experiment = experiments[condition]
    # These assays read stored values, or count eaten items.
    needs_fitness = name not in ("descent", "within-life") and not (
        name == "innate" and not experiment.learns
    )
    setting = find_archive_fitness(experiment)
    if setting and needs_fitness:
        return (
            f"the assay {name} simulates stored agents outside their run, and {setting} of "
            f"{condition} depends on the earlier generations of a run"
        )
    if experiment.births_in_life and name != "descent":
        return (
            f"the assay {name} simulates complete lifetimes of stored genomes, "
            "but newborns replace agents during life in this experiment"
        )
    if name == OPPONENTS:
        return opponents.find_obstacle(experiment)
    if experiment.population.species and name != "descent":
        return f"the assay {name} needs a population without species, and {condition} has several"
    if name in ("innate", "descent"):
        return ""
    if name == "reaction-norms":
        return reaction_norms.find_obstacle(condition, experiment)
    if name == "canalization":
        return canalization.find_obstacle(condition, experiment)
    if name in FORKS:
        return next(fork.find_obstacles(name, experiment), "")
    if name == "neutral":
        return _why_not_neutral(experiment)
    if name == "modules":
        if "reinforcement" in experiment.modules:
            return ""
        return "the assay modules needs agents with a reinforcement module"
    if not isinstance(experiment, Experiment):
        return f"the assay {name} needs the model miniworld, not {experiment.model}"
    if name == UNSEEN_MAPS and not experiment.world.food:
        return f"the assay {name} needs a map with food, and {condition} has none"
    return ""


def why_not_in_study(name: str, study: StudyStore, condition: str) -> str:
    """Return why an assay cannot measure the stored runs of a condition; "" if it can."""
    reason = why_not_applicable(name, condition, study.experiments)
    if reason or name not in FORKS:
        return reason
    control = find_control(condition, study.experiments)
    if not control:
        return ""
    missing = set(sample_runs(study, condition)).difference(study.runs(control))
    if not missing:
        return ""
    return (
        f"the assay {name} compares {condition} with the same runs of {control}, but run "
        f"{min(missing)} of {control} is not stored; complete the study first"
    )


def _why_not_neutral(experiment: BaseExperiment) -> str:
    if experiment.evolution.inheritance == "none":
        return "the assay neutral measures effects of selection, which needs inherited genomes"
    if experiment.evolution.selection == "neutral":
        return "the assay neutral measures effects of selection, but parents are chosen at random"
    return ""


def not_applicable_reasons(study: StudyStore, names: Sequence[str]) -> list[str]:
    """Return the distinct sentences of `why_not_in_study` for all conditions of a study."""
    require_assay_names(names)
    reasons = (
        why_not_in_study(name, study, condition)
        for condition in study.experiments
        for name in names
    )
    return [sentence for sentence in dict.fromkeys(reasons) if sentence]


def require_assay_names(names: Sequence[str]) -> None:
    """Raise StudyError for a name of no assay."""
    for name in names:
        if name not in ASSAYS:
            raise StudyError(f"there is no assay {name!r}; there are {', '.join(ASSAYS)}")
