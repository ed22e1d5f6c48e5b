"""Declaration of an assay, and the obstacles that several assays share.

An assay is a module of this package with an `Assay` in `ASSAYS`; `catalog` finds it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from baldwinlab.core.variables import Variable
from baldwinlab.evolution import find_archive_fitness
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.simulation import memory
from baldwinlab.studies.assays.sample import Conditions, Sample

Arrays = Mapping[str, npt.NDArray[Any]]
# Returns why a condition of this name cannot be measured, as the end of a sentence that begins with
# the name of the assay, for example "needs a condition that learns". Returns "" if it can.
FindObstacle = Callable[[str, BaseExperiment], str]


def declare_fitness(dims: tuple[str, ...], meaning: str) -> Variable:
    """Declare a fitness with the dimension `run` and these dimensions. Files call it energy."""
    return Variable(("run", *dims), np.float64, "energy", meaning)


def find_archive_obstacle(condition: str, experiment: BaseExperiment) -> str:
    """Refuse a fitness that a simulation of one generation cannot repeat."""
    setting = find_archive_fitness(experiment)
    if not setting:
        return ""
    return (
        f"simulates stored agents outside their run, and {setting} of {condition} depends on the "
        "earlier generations of a run"
    )


def find_birth_obstacle(condition: str, experiment: BaseExperiment) -> str:
    """Refuse newborns during life."""
    if not experiment.births_in_life:
        return ""
    return (
        "simulates complete lifetimes of stored genomes, but newborns replace agents during life "
        "in this experiment"
    )


def find_species_obstacle(condition: str, experiment: BaseExperiment) -> str:
    """Refuse several species."""
    if not experiment.population.species:
        return ""
    return f"needs a population without species, and {condition} has several"


def find_model_obstacle(condition: str, experiment: BaseExperiment) -> str:
    """Refuse other models than MiniWorld."""
    if isinstance(experiment, Experiment):
        return ""
    return f"needs the model miniworld, not {experiment.model}"


# Obstacles to a simulation of stored genomes with another setting.
SIMULATION_OBSTACLES: Final = (find_archive_obstacle, find_birth_obstacle, find_species_obstacle)


@dataclass(frozen=True)
class Assay:
    """A measurement of the stored genomes of a condition."""

    # The name in commands and paths.
    name: str
    # The question that it answers.
    question: str
    # The stored variables.
    variables: Mapping[str, Variable]
    # Returns the coordinates of the dataset of a condition, except `run` and `agent`.
    coordinates: Callable[[Conditions, str], Mapping[str, Any]]
    # Returns the number of simulated generations per run of a condition.
    count_lives: Callable[[Conditions, str], int]
    # Returns the stored variables of a sample, with `run` as the first dimension.
    measure: Callable[[Sample], Arrays]
    # The first obstacle that is found is reported.
    obstacles: tuple[FindObstacle, ...] = SIMULATION_OBSTACLES
    # Whether a command measures the assay without naming it.
    is_default: bool = False
    # Returns the simulated experiments, other than the condition with and without learning.
    variants: Callable[[BaseExperiment], Iterable[BaseExperiment]] = lambda experiment: ()
    # Whether `Sample.other_maps` is read.
    uses_other_maps: bool = False
    # Whether `Sample.control` is read.
    uses_control: bool = False
    # Returns the assay with branches of this number of generations, if it evolves populations.
    with_branches: Callable[[int], Assay] | None = None
    # Attributes of the dataset, in addition to those of every assay.
    attributes: Mapping[str, Any] = field(default_factory=dict)
    # Returns the bytes of memory that the measurement of a number of runs needs.
    work_bytes: Callable[[Experiment, int], int] = memory.simulation_bytes
    # Number of records of a run in memory.
    n_records: int = 1

    def find_obstacle(self, condition: str, experiment: BaseExperiment) -> str:
        """Return a sentence that says why the assay is not applicable; "" if it is applicable."""
        sentence_ends = (find(condition, experiment) for find in self.obstacles)
        obstacle = next(filter(None, sentence_ends), "")
        return f"the assay {self.name} {obstacle}" if obstacle else ""
