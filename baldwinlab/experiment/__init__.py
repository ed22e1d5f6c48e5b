"""The experiment: everything that decides a result, apart from the seed."""

from baldwinlab.experiment.base import NAME_PATTERN, BaseExperiment, Evolution, assign, validate
from baldwinlab.experiment.fields import ExperimentError, Fields, merge
from baldwinlab.experiment.miniworld import Experiment, FoodRegion, World
from baldwinlab.experiment.paths import look_up

__all__ = [
    "NAME_PATTERN",
    "BaseExperiment",
    "Evolution",
    "Experiment",
    "ExperimentError",
    "Fields",
    "FoodRegion",
    "World",
    "assign",
    "kind_and_map",
    "look_up",
    "merge",
    "validate",
]


def kind_and_map(name: str) -> tuple[str, str]:
    """`evo/A` is the kind `evo` on the map `A`; a name without a slash has no map, ""."""
    kind, slash, map_name = name.rpartition("/")
    return (kind, map_name) if slash else (name, "")
