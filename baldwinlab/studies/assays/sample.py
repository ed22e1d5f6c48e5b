"""Stored runs of one condition, to be lived again side by side."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
import numpy.typing as npt
import xarray as xr

from baldwinlab.evolution import GenerationKey, Genome, draw_genomes
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.factors import Factors
from baldwinlab.simulation.reevaluation import Outcomes, reevaluate, stored_genome
from baldwinlab.studies.records import StudyError, record_path

Energy = npt.NDArray[np.float64]  # [run, agent]
OnMap = tuple[str, Experiment]  # the name of a map, and the condition there


class Conditions(Protocol):
    """What an assay needs to know of a study to say what it will measure."""

    @property
    def experiments(self) -> Mapping[str, Experiment]: ...

    @property
    def factors(self) -> Mapping[str, Factors]: ...


@dataclass(frozen=True)
class Sample:
    """Some stored runs of a condition. Arrays that are measured on it begin with the dimension `run`, in this order."""

    directory: Path  # of the study
    seed: int
    experiment: Experiment
    runs: tuple[int, ...]
    records: Sequence[xr.Dataset]
    elsewhere: Sequence[OnMap]  # the same condition on the study's other maps
    lived: Callable[
        [int], None
    ]  # is told the agent-steps that have been lived; what it raises ends the work

    def genomes(self, generation: int) -> Genome:
        """Of that generation, [run, agent, module, weight]."""
        return np.stack(
            [stored_genome(self.experiment, record, generation) for record in self.records]
        )

    def random_genomes(self) -> Genome:
        """Freshly drawn genomes, as those of a generation after the last, so that no draw is shared with one that lived."""
        after = self.experiment.evolution.generations
        return np.stack(
            [
                draw_genomes(self.experiment, GenerationKey(self.seed, run, after))
                for run in self.runs
            ]
        )

    def energy(self, generation: int) -> Energy:
        return np.stack([record.energy.values[generation] for record in self.records])

    def simulate(self, experiment: Experiment, generation: int, genomes: Genome) -> Outcomes:
        """Lives of these genomes in the worlds of that generation, under the circumstances of `experiment`."""
        lives = reevaluate(experiment, self.seed, self.runs, generation, genomes)
        self.tell()
        return lives

    def simulate_as_evolved(self, generation: int, genomes: Genome) -> Outcomes:
        """Lives as they were in the study. Raises StudyError where they are not what is stored."""
        lives = self.simulate(self.experiment, generation, genomes)
        for run, found, stored in zip(
            self.runs, lives.energy, self.energy(generation), strict=True
        ):
            if not np.array_equal(found, stored):
                path = record_path(self.directory, self.experiment.name, run)
                gain = "eat" if isinstance(self.experiment, Experiment) else "gain"
                raise StudyError(
                    f"{path}: generation {generation}, lived again, does not {gain} what is stored; "
                    f"another version of baldwinlab made this study"
                )
        return lives

    def tell(self) -> None:
        """Say that one generation of these runs has lived."""
        self.lived(len(self.runs) * self.experiment.steps * self.experiment.population.size)


def first_middle_last(generations: int) -> list[int]:
    """The first generation, the middle one and the last, as far as they differ."""
    return sorted({0, generations // 2, generations - 1})
