"""Estimate the memory and disk space of assays, as `baldwinlab.simulation.memory` does for runs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Final, NamedTuple

from baldwinlab.core.resources import NO_NEED, Need
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.conditions import Factors
from baldwinlab.experiment.toml import to_toml
from baldwinlab.models.miniworld.backends.choice import CPU
from baldwinlab.simulation import memory
from baldwinlab.studies.assays.assay import Conditions
from baldwinlab.studies.assays.catalog import get_assay, get_assays

# Bytes of a file in addition to its variables and its experiment.
HEADER_BYTES: Final = 1000
# Copies of the results: of single runs, of all runs, and as a file.
RESULT_COPIES: Final = 3


class PlannedStudy(NamedTuple):
    """Conditions of a study that does not exist yet."""

    experiments: Mapping[str, Experiment]
    factors: Mapping[str, Factors]

    def need(self, runs: int, workers: int, assays: Sequence[str]) -> Need:
        """Estimate the applicable assays with `runs` runs of each condition."""
        missing = self.select_applicable(assays)
        runs_by_condition = dict.fromkeys(missing, runs)
        return estimate_assays(self, missing, runs_by_condition, workers)

    def select_applicable(self, assays: Sequence[str]) -> dict[str, list[str]]:
        """Return the names of the applicable assays of each condition."""
        return {
            condition: [
                assay.name for assay in get_assays(assays) if not assay.find_obstacle(experiment)
            ]
            for condition, experiment in self.experiments.items()
        }


def estimate_assays(
    study: Conditions, missing: Mapping[str, Sequence[str]], runs: Mapping[str, int], workers: int
) -> Need:
    """Estimate the memory and disk space of missing assays.

    Returns memory and disk space in bytes.
    """
    total_runs = sum(runs.values())
    runs_per_task = max(1, min(CPU.worlds, total_runs // workers))
    tasks = []
    disk = 0
    largest_results_bytes = 0
    header_bytes = 0
    for condition, names in missing.items():
        if names:
            experiment = study.experiments[condition]
            n_runs = runs[condition]
            if not header_bytes:
                # All experiments of a study have about the same length.
                header_bytes = HEADER_BYTES + len(to_toml(experiment).encode())
            n_tasks = math.ceil(n_runs / runs_per_task)
            tasks.append((_task_bytes(experiment, names, runs_per_task), n_tasks))
            results_bytes = sum(_results_bytes(study, condition, name, n_runs) for name in names)
            disk += results_bytes + len(names) * header_bytes
            largest_results_bytes = max(largest_results_bytes, results_bytes)
    if not tasks:
        return NO_NEED
    task_memory = memory.largest_total(tasks, workers)
    return Need(
        memory.ENGINE_BYTES + task_memory + RESULT_COPIES * largest_results_bytes, disk=disk
    )


def _task_bytes(experiment: Experiment, names: Sequence[str], n_runs: int) -> int:
    """Return the memory of a task with some runs of a condition, in bytes."""
    assays = get_assays(names)
    record_bytes = memory.dataset_bytes(experiment) * max(assay.n_records for assay in assays)
    # A task measures its assays one after the other.
    work_bytes = max(assay.work_bytes(experiment, n_runs) for assay in assays)
    return n_runs * record_bytes + max(memory.simulation_bytes(experiment, n_runs), work_bytes)


def _results_bytes(study: Conditions, condition: str, name: str, n_runs: int) -> int:
    """Return the size of the variables of an assay in bytes."""
    assay = get_assay(name)
    coordinates = assay.coordinates(study, condition)
    sizes = {"run": n_runs, "agent": study.experiments[condition].population.size}
    sizes |= {dim: len(values) for dim, values in coordinates.items()}
    return sum(memory.variable_bytes(assay.variables, sizes).values())
