"""Assays: re-simulate the genomes of a stored study under changed conditions and measure them.

A module of this package declares an assay as a constant of the type `Assay`. `catalog.py` finds it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from baldwinlab.core.deferred import xr
from baldwinlab.core.variables import STOP_ATTRIBUTE, Variable
from baldwinlab.evolution import Genome, draw_genomes, find_archive_fitness, make_run_keys
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.experiment.conditions import Factors
from baldwinlab.simulation import memory
from baldwinlab.simulation.reevaluation import (
    Outcomes,
    reevaluate,
    reevaluate_species,
    restore_genomes,
)
from baldwinlab.studies.record_files import StudyError, find_record_file

Arrays = Mapping[str, npt.NDArray[Any]]
# Function that returns why an assay cannot measure a condition, as the end of a sentence about the
# assay: "needs a condition that learns". Returns "" if the assay is applicable.
FindObstacle = Callable[[BaseExperiment], str]
# Fitness [run, agent]. Files and variables call the fitness energy.
Energy = npt.NDArray[np.float64]
# Name of a map, and the experiment on this map.
OnMap = tuple[str, Experiment]
# Kinds of lifetimes: without learning, with learning, with the weights at death and without
# learning, and with random weight changes instead of learning. Arrays use the index of a kind.
LIFE_KINDS = ("off", "on", "frozen", "drift")
OFF, ON, FROZEN, DRIFT = range(len(LIFE_KINDS))


class Conditions(Protocol):
    """Experiments and factors of a study, which determine the labels of the results of an assay."""

    @property
    def experiments(self) -> Mapping[str, Experiment]: ...

    @property
    def factors(self) -> Mapping[str, Factors]: ...


@dataclass(frozen=True)
class Sample:
    """Stored runs of a condition. The first dimension of all arrays is `run`, as in `runs`."""

    directory: Path
    seed: int
    experiment: Experiment
    runs: tuple[int, ...]
    records: Sequence[xr.Dataset]
    # The maps of `list_other_maps`, if the assay uses them.
    other_maps: Sequence[OnMap]
    # Called with the number of simulated agent-steps. An exception in this function ends the task.
    report_progress: Callable[[int], None]
    # The same runs of the no-learning control, if the assay needs them.
    control: Sample | None = None

    def genomes(self, generation: int) -> Genome:
        """Return the genomes of a generation [run, agent, module, weight].

        If a run stopped before, the genomes of its last generation are returned.
        """
        return np.stack(
            [
                restore_genomes(self.experiment, record, _limit_generation(record, generation))
                for record in self.records
            ]
        )

    def random_genomes(self) -> Genome:
        """Return random genomes [run, agent, module, weight]."""
        # The key of a later generation gives random numbers that no run has used.
        unused_generation = self.experiment.evolution.generations
        keys = make_run_keys(self.seed, self.runs, unused_generation)
        return draw_genomes(self.experiment, keys)

    def energy(self, generation: int) -> Energy:
        """Return the stored energy [run, agent] of a generation. Stopped runs: see `genomes`."""
        return np.stack(
            [record.energy.values[_limit_generation(record, generation)] for record in self.records]
        )

    def has_generation(self, generation: int) -> npt.NDArray[np.bool_]:
        """Return, for each run, whether it has a generation, and did not stop before."""
        return np.array([generation < record.sizes["generation"] for record in self.records])

    def simulate(self, experiment: Experiment, generation: int, genomes: Genome) -> Outcomes:
        """Simulate genomes in the world (positions, random numbers) of a generation."""
        outcomes = reevaluate(experiment, self.seed, self.runs, generation, genomes)
        self.report_generation()
        return outcomes

    def simulate_species(self, generation: int, genomes: Genome) -> Energy:
        """Simulate genomes of several species as `simulate` does. Return the energy."""
        energy = reevaluate_species(self.experiment, self.seed, self.runs, generation, genomes)
        self.report_generation()
        return energy

    def simulate_as_evolved(self, generation: int, genomes: Genome) -> Outcomes:
        """Simulate a generation as in the study.

        Raises StudyError if the energy differs from the stored one.
        """
        outcomes = self.simulate(self.experiment, generation, genomes)
        self.require_stored_energy(generation, outcomes.energy)
        return outcomes

    def require_stored_energy(self, generation: int, energy: Energy) -> None:
        """Raise StudyError if the energy of a generation differs from the stored one."""
        stored_energy = self.energy(generation)
        has_generation = self.has_generation(generation)
        for run, simulated, stored, is_stored in zip(
            self.runs, energy, stored_energy, has_generation, strict=True
        ):
            if is_stored and not np.array_equal(simulated, stored):
                path = find_record_file(self.directory, self.experiment.name, run).path
                verb = "eat" if isinstance(self.experiment, Experiment) else "gain"
                raise StudyError(
                    f"{path}: generation {generation}, simulated again, does not {verb} "
                    "the stored amount; another version of baldwinlab made this study"
                )

    def report_generation(self) -> None:
        """Report the agent-steps of one simulated generation."""
        self.report_progress(len(self.runs) * self.experiment.agent_steps)


def _limit_generation(record: xr.Dataset, generation: int) -> int:
    """Return a generation, or the last generation of the record if the run stopped before."""
    last_generation = record.sizes["generation"] - 1
    return min(generation, last_generation) if STOP_ATTRIBUTE in record.attrs else generation


def select_last_settings(experiment: Experiment) -> Experiment:
    """Return the settings of the last generation."""
    return experiment.at(experiment.evolution.generations - 1)


def list_other_maps(study: Conditions, condition: str) -> tuple[OnMap, ...]:
    """Return the last settings of a condition on each other map of the same learner in a study."""
    experiment = select_last_settings(study.experiments[condition])
    factors = study.factors[condition]
    maps: list[OnMap] = []
    for candidate_name, candidate in study.factors.items():
        if factors.map and candidate.map and candidate.learner == factors.learner:
            world = select_last_settings(study.experiments[candidate_name]).world
            moved_experiment = experiment.replace(world=world)
            on_map = (candidate.map, moved_experiment)
            if moved_experiment != experiment and on_map not in maps:
                maps.append(on_map)
    return tuple(maps)


def first_middle_last(generations: int) -> list[int]:
    """Return the first, the middle and the last generation without duplicates."""
    return sorted({0, generations // 2, generations - 1})


def declare_fitness(dims: tuple[str, ...], meaning: str) -> Variable:
    """Declare a fitness with the dimension `run`, and then `dims`. The unit is energy."""
    return Variable(("run", *dims), np.float64, "energy", meaning)


def find_archive_obstacle(experiment: BaseExperiment) -> str:
    """Refuse a fitness that a simulation of one generation cannot repeat."""
    setting = find_archive_fitness(experiment)
    if not setting:
        return ""
    return (
        f"simulates stored agents outside their run, and {setting} of {experiment.name} depends "
        "on the earlier generations of a run"
    )


def find_birth_obstacle(experiment: BaseExperiment) -> str:
    """Refuse experiments in which newborns replace agents during life."""
    if not experiment.births_in_life:
        return ""
    return (
        "simulates complete lifetimes of stored genomes, but newborns replace agents during life "
        "in this experiment"
    )


def find_species_obstacle(experiment: BaseExperiment) -> str:
    """Refuse experiments with several species."""
    if not experiment.population.species:
        return ""
    return f"needs a population without species, and {experiment.name} has several"


def find_model_obstacle(experiment: BaseExperiment) -> str:
    """Refuse other models than MiniWorld."""
    if isinstance(experiment, Experiment):
        return ""
    return f"needs the model miniworld, not {experiment.model}"


# Obstacles to a simulation of stored genomes with another setting.
SIMULATION_OBSTACLES: Final = (find_archive_obstacle, find_birth_obstacle, find_species_obstacle)


class AssayPlan(NamedTuple):
    """Results and work of an assay of a condition."""

    # Coordinates of the dataset, except `run` and `agent`.
    coordinates: Mapping[str, Any]
    # Number of generations that are simulated for each run.
    n_lives: int


@dataclass(frozen=True)
class Assay:
    """A measurement of the stored genomes of a condition."""

    # The name in commands and paths.
    name: str
    # The question that the assay answers.
    question: str
    # The variables that are stored.
    variables: Mapping[str, Variable]
    # Returns the plan of the assay for a condition of a study.
    plan: Callable[[Conditions, str], AssayPlan]
    # Returns the stored variables of a sample, with `run` as the first dimension.
    measure: Callable[[Sample], Arrays]
    # The assay is applicable if none of these functions finds an obstacle.
    obstacles: tuple[FindObstacle, ...] = SIMULATION_OBSTACLES
    # Whether a command measures the assay by default.
    is_default: bool = False
    # Returns the experiments to compile, in addition to the condition with and without learning.
    variants: Callable[[BaseExperiment], Iterable[BaseExperiment]] = lambda experiment: ()
    # Whether `Sample.other_maps` is read.
    uses_other_maps: bool = False
    # Whether `Sample.control` is read.
    uses_control: bool = False
    # Returns a fork with branches of this number of generations. None for other assays.
    with_branches: Callable[[int], Assay] | None = None
    # Attributes of the dataset, in addition to the attributes that every assay has.
    attributes: Mapping[str, Any] = field(default_factory=dict)
    # Returns the bytes of memory that the measurement of a number of runs needs.
    work_bytes: Callable[[Experiment, int], int] = memory.simulation_bytes
    # Number of records per run that are in memory at the same time.
    n_records: int = 1

    def find_obstacle(self, experiment: BaseExperiment) -> str:
        """Return a sentence that says why the assay is not applicable; "" if it is applicable."""
        sentence_ends = (find(experiment) for find in self.obstacles)
        obstacle = next(filter(None, sentence_ends), "")
        return f"the assay {self.name} {obstacle}" if obstacle else ""
