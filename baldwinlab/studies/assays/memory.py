"""Estimate the memory and disk space of assays, as `baldwinlab.simulation.memory` does for runs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np

from baldwinlab.core.assay_variables import ASSAY_VARIABLES, FORKS
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
BITS_PER_BYTE: Final = 8
# Bytes of a file in addition to its variables and its experiment.
HEADER_BYTES: Final = 1000
# Arrays of shares of founders in the memory of `effective_ancestors`.
SHARE_COPIES: Final = 4
# Copies of the sets of descendants, which have a bit for each agent.
DESCENDANT_COPIES: Final = 2
# Runs in the memory of a fork: of the learner, of the control, and of a branch.
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
        runs_by_condition = dict.fromkeys(missing, runs)
        return estimate_assays(self, missing, runs_by_condition, workers)

    def select_applicable(self, assays: Sequence[str]) -> dict[str, list[str]]:
        """Return the applicable assays of each condition."""

        def is_applicable(assay: str, name: str) -> bool:
            return not why_not_applicable(assay, name, self.experiments)

        return {
            name: [assay for assay in assays if is_applicable(assay, name)]
            for name in self.experiments
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


def _task_bytes(experiment: Experiment, names: Sequence[str], n_worlds: int) -> int:
    """Return the memory of a task with some runs of a condition, in bytes."""
    simulation_bytes = memory.simulation_bytes(experiment, n_worlds)
    if "within-life" in names:
        simulation_bytes *= SAVED_STATES
    descent_bytes = _descent_bytes(experiment) if "descent" in names else 0
    has_fork = any(name in FORKS for name in names)
    n_datasets = n_worlds * (RUNS_OF_FORK if has_fork else 1)
    # A task measures its assays one after the other.
    return n_datasets * memory.dataset_bytes(experiment) + max(simulation_bytes, descent_bytes)


def _descent_bytes(experiment: Experiment) -> int:
    """Return the memory of the assay of descent for one run, in bytes."""
    n_agents = experiment.population.size
    n_shares = n_agents * min(n_agents, FOUNDERS_PER_BATCH)
    share_bytes = SHARE_COPIES * np.dtype(np.float64).itemsize * n_shares
    child_bytes = experiment.evolution.generations * BYTES_PER_CHILD
    descendant_bytes = DESCENDANT_COPIES * n_agents // BITS_PER_BYTE
    return n_agents * (child_bytes + descendant_bytes) + share_bytes


def _results_bytes(study: Conditions, condition: str, name: str, n_runs: int) -> int:
    """Return the size of the variables of an assay in bytes."""
    coordinates = ASSAYS[name].coordinates(study, condition)
    sizes = {"run": n_runs, "agent": study.experiments[condition].population.size}
    sizes |= {dim: len(values) for dim, values in coordinates.items()}
    return sum(memory.variable_bytes(ASSAY_VARIABLES[name], sizes).values())
