"""The experiment: all settings of one condition. With the seed, they determine the results."""

from baldwinlab.experiment.base import BaseExperiment, assign, validate
from baldwinlab.experiment.fields import ExperimentError, Fields, merge
from baldwinlab.experiment.miniworld import Experiment
from baldwinlab.experiment.miniworld_tables import FoodRegion, World
from baldwinlab.experiment.paths import look_up
from baldwinlab.experiment.tables import Evolution

__all__ = [
    "BaseExperiment",
    "Evolution",
    "Experiment",
    "ExperimentError",
    "Fields",
    "FoodRegion",
    "World",
    "assign",
    "look_up",
    "merge",
    "validate",
]
