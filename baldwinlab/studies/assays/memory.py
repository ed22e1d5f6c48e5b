"""What assays will take, before the first life is lived again: memory and disk, as `baldwinlab.simulation.memory` says of runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final, NamedTuple

from baldwinlab.core import variables
from baldwinlab.core.resources import NOTHING, Need
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.factors import Factors
from baldwinlab.experiment.toml import to_toml
from baldwinlab.models.miniworld.backends.choice import CPU
from baldwinlab.simulation import memory
from baldwinlab.studies.assays.descent import FOUNDERS_PER_BATCH
from baldwinlab.studies.assays.run import ASSAYS, why_not_applicable
from baldwinlab.studies.assays.sample import Conditions

SAVED_STATES: Final = 10  # states that are kept to go back to, where the step of the first meal is looked for by halves
BYTES_PER_CHILD: Final = 150  # a child and its parents, as Python has them
HEADER: Final = 1000  # of a file, beside its variables and its experiment
COPIES: Final = 3  # of what is measured: of each run, of all together, and as it is stored


class PlannedStudy(NamedTuple):
    """The conditions of a study that is not there yet."""

    experiments: Mapping[str, Experiment]
    factors: Mapping[str, Factors]

    def need(self, runs: int, workers: int, assays: Sequence[str] = tuple(ASSAYS)) -> Need:
        """Of those assays that have something to measure there, on so many runs of each condition."""
        missing = self.fitting(assays)
        return estimate_assays(self, missing, dict.fromkeys(missing, runs), workers)

    def fitting(self, assays: Sequence[str]) -> dict[str, list[str]]:
        """Select for each condition the assays that have something to measure there."""
        return {
            name: [assay for assay in assays if not why_not_applicable(assay, one)]
            for name, one in self.experiments.items()
        }


def estimate_assays(
    study: Conditions, missing: Mapping[str, Sequence[str]], runs: Mapping[str, int], workers: int
) -> Need:
    """Of the assays that are missing, by condition, of so many runs of each, on so many threads."""
    total = sum(runs.values())
    size = max(1, min(CPU.worlds, total // workers))
    tasks, disk, results, header = [], 0, 0, 0
    for condition, names in missing.items():
        if names:
            header = header or HEADER + len(
                to_toml(study.experiments[condition]).encode()
            )  # they are about as long
            tasks.append(
                (_task(study.experiments[condition], names, size), -(-runs[condition] // size))
            )
            stored = sum(_stored(study, condition, name, runs[condition]) for name in names)
            disk, results = disk + stored + len(names) * header, max(results, stored)
    return (
        Need(memory.ENGINE + memory.largest_total(tasks, workers) + COPIES * results, disk)
        if tasks
        else NOTHING
    )


def _task(experiment: Experiment, names: Sequence[str], worlds: int) -> int:
    """Memory for some runs of a condition, side by side."""
    living = memory.simulation_bytes(experiment, worlds) * (
        SAVED_STATES if "within-life" in names else 1
    )
    agents, generations = experiment.population.size, experiment.evolution.generations
    shares = 4 * 8 * agents * min(agents, FOUNDERS_PER_BATCH)
    pedigree = (
        agents * (generations * BYTES_PER_CHILD + agents // 4) + shares if "descent" in names else 0
    )
    return worlds * memory.dataset_bytes(experiment) + max(living, pedigree)


def _stored(study: Conditions, condition: str, name: str, runs: int) -> int:
    """What the variables in the file of an assay take."""
    coords = ASSAYS[name].coordinates(study, condition)
    there = {"run": runs, "agent": study.experiments[condition].population.size}
    there |= {dim: len(values) for dim, values in coords.items()}
    return sum(memory.variable_bytes(variables.ASSAYS[name], there).values())
