"""Estimate the memory and disk space of assays, as `baldwinlab.simulation.memory` does for runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final, NamedTuple

from baldwinlab.core import variables
from baldwinlab.core.resources import NO_NEED, Need
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.factors import Factors
from baldwinlab.experiment.toml import to_toml
from baldwinlab.models.miniworld.backends.choice import CPU
from baldwinlab.simulation import memory
from baldwinlab.studies.assays.catalog import ASSAYS, why_not_applicable
from baldwinlab.studies.assays.descent import FOUNDERS_PER_BATCH
from baldwinlab.studies.assays.sample import Conditions

# Stored states in the bisection for the step of the first meal.
SAVED_STATES: Final = 10
# Bytes of a child and its parents as Python objects.
BYTES_PER_CHILD: Final = 150
# Bytes of a file in addition to its variables and its experiment.
HEADER_BYTES: Final = 1000
# Runs in the memory of a fork: those of the learner and of the control, and a branch.
RUNS_OF_FORK: Final = 3
# Copies of the results: of single runs, of all runs, and as a file.
RESULT_COPIES: Final = 3


class PlannedStudy(NamedTuple):
    """Conditions of a study that does not exist yet."""

    experiments: Mapping[str, Experiment]
    factors: Mapping[str, Factors]

    def need(self, runs: int, workers: int, assays: Sequence[str] = tuple(ASSAYS)) -> Need:
        """Estimate the applicable assays with `runs` runs of each condition."""
        missing = self.select_applicable(assays)
        return estimate_assays(self, missing, dict.fromkeys(missing, runs), workers)

    def select_applicable(self, assays: Sequence[str]) -> dict[str, list[str]]:
        """Return the applicable assays of each condition."""
        return {
            name: [
                assay for assay in assays if not why_not_applicable(assay, name, self.experiments)
            ]
            for name in self.experiments
        }


def estimate_assays(
    study: Conditions, missing: Mapping[str, Sequence[str]], runs: Mapping[str, int], workers: int
) -> Need:
    """Estimate the memory and disk space of missing assays.

    Parameters
    ----------
    study : Conditions
        The study.
    missing : mapping
        Names of the missing assays by condition.
    runs : mapping
        Number of runs by condition.
    workers : int
        Number of tasks that are executed in parallel.

    Returns
    -------
    Need
        Memory and disk space in bytes.
    """
    total = sum(runs.values())
    size = max(1, min(CPU.worlds, total // workers))
    tasks = []
    disk = 0
    results = 0
    header = 0
    for condition, names in missing.items():
        if names:
            experiment = study.experiments[condition]
            # All experiments of a study have about the same length.
            header = header or HEADER_BYTES + len(to_toml(experiment).encode())
            tasks.append((_task_bytes(experiment, names, size), -(-runs[condition] // size)))
            stored = sum(_stored_bytes(study, condition, name, runs[condition]) for name in names)
            disk += stored + len(names) * header
            results = max(results, stored)
    if not tasks:
        return NO_NEED
    return Need(
        memory.ENGINE_BYTES + memory.largest_total(tasks, workers) + RESULT_COPIES * results, disk
    )


def _task_bytes(experiment: Experiment, names: Sequence[str], worlds: int) -> int:
    """Return the memory of a task with some runs of a condition, in bytes."""
    simulation = memory.simulation_bytes(experiment, worlds) * (
        SAVED_STATES if "within-life" in names else 1
    )
    agents = experiment.population.size
    generations = experiment.evolution.generations
    shares = 4 * 8 * agents * min(agents, FOUNDERS_PER_BATCH)
    pedigree = (
        agents * (generations * BYTES_PER_CHILD + agents // 4) + shares if "descent" in names else 0
    )
    datasets = RUNS_OF_FORK if any(name in variables.FORKS for name in names) else 1
    return worlds * datasets * memory.dataset_bytes(experiment) + max(simulation, pedigree)


def _stored_bytes(study: Conditions, condition: str, name: str, runs: int) -> int:
    """Return the size of the variables of an assay in bytes."""
    coords = ASSAYS[name].coordinates(study, condition)
    sizes = {"run": runs, "agent": study.experiments[condition].population.size}
    sizes |= {dim: len(values) for dim, values in coords.items()}
    return sum(memory.variable_bytes(variables.ASSAY_VARIABLES[name], sizes).values())
