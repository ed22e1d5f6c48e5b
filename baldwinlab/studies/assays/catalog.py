"""Catalog of the assays, with checks of their applicability and estimates of memory and disk."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import Final, NamedTuple

from baldwinlab.core.resources import NO_NEED, Need
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.conditions import Factors, find_control
from baldwinlab.experiment.toml import to_toml
from baldwinlab.models.miniworld.backends.cpu import BLOCK_WORLDS
from baldwinlab.simulation import memory
from baldwinlab.studies.assays import Assay, Conditions
from baldwinlab.studies.open import sample_runs
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore

# Bytes of a file in addition to its variables and its experiment.
HEADER_BYTES: Final = 1000
# Number of copies of the results in memory: of single tasks, of all runs, and as a file.
RESULT_COPIES: Final = 3


@cache
def load_assays() -> Mapping[str, Assay]:
    """Return the assays that the modules of this package declare, the default assays first."""
    modules = [
        import_module(f"{__package__}.{module.name}")
        for module in iter_modules([str(Path(__file__).parent)])
    ]
    declared = [
        value for module in modules for value in vars(module).values() if isinstance(value, Assay)
    ]
    declared.sort(key=lambda assay: (not assay.is_default, assay.name))
    return {assay.name: assay for assay in declared}


def get_assay(name: str, generations: int | None = None) -> Assay:
    """Return an assay. Raises StudyError for an unknown name.

    `generations`: number of generations of the branches of a fork. Other assays ignore it.
    """
    assays = load_assays()
    if name not in assays:
        raise StudyError(f"there is no assay {name!r}; there are {', '.join(assays)}")
    assay = assays[name]
    if generations is None or assay.with_branches is None:
        return assay
    return assay.with_branches(generations)


def get_assays(names: Iterable[str]) -> list[Assay]:
    """Return the assays with these names. Raises StudyError for an unknown name."""
    return [get_assay(name) for name in names]


def list_default_assays() -> tuple[str, ...]:
    """Return the names of the assays that a command measures by default."""
    return tuple(name for name, assay in load_assays().items() if assay.is_default)


def why_not_in_study(name: str, study: StudyStore, condition: str) -> str:
    """Return why an assay cannot measure the stored runs of a condition; "" if it can."""
    assay = get_assay(name)
    obstacle = assay.find_obstacle(study.experiments[condition])
    if obstacle or not assay.uses_control:
        return obstacle
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


def not_applicable_reasons(study: StudyStore, names: Sequence[str]) -> list[str]:
    """Return the distinct sentences of `why_not_in_study` for all conditions of a study.

    Raises StudyError for an unknown name.
    """
    get_assays(names)
    reasons = (
        why_not_in_study(name, study, condition)
        for condition in study.experiments
        for name in names
    )
    return [sentence for sentence in dict.fromkeys(reasons) if sentence]


class PlannedStudy(NamedTuple):
    """Conditions of a study that does not exist yet."""

    experiments: Mapping[str, Experiment]
    factors: Mapping[str, Factors]

    def need(self, runs: int, workers: int, assays: Sequence[str]) -> Need:
        """Estimate the memory and disk space of assays with `runs` runs of each condition."""
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
    """Estimate the memory and disk space of missing assays, in bytes."""
    total_runs = sum(runs.values())
    runs_per_task = max(1, min(BLOCK_WORLDS, total_runs // workers))
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
            # A file with a control also has the experiment of the control.
            n_headers = sum(1 + assay.uses_control for assay in get_assays(names))
            disk += results_bytes + n_headers * header_bytes
            largest_results_bytes = max(largest_results_bytes, results_bytes)
    if not tasks:
        return NO_NEED
    task_memory = memory.largest_total(tasks, workers)
    return Need(
        memory.ENGINE_BYTES + task_memory + RESULT_COPIES * largest_results_bytes, disk=disk
    )


def _task_bytes(experiment: Experiment, names: Sequence[str], n_runs: int) -> int:
    """Return the memory of a task with `n_runs` runs of a condition, in bytes."""
    assays = get_assays(names)
    record_bytes = memory.dataset_bytes(experiment) * max(assay.n_records for assay in assays)
    # A task measures its assays one after the other.
    work_bytes = max(assay.work_bytes(experiment, n_runs) for assay in assays)
    return n_runs * record_bytes + max(memory.simulation_bytes(experiment, n_runs), work_bytes)


def _results_bytes(study: Conditions, condition: str, name: str, n_runs: int) -> int:
    """Return the size of the variables of an assay in bytes."""
    assay = get_assay(name)
    coordinates = assay.plan(study, condition).coordinates
    sizes = {"run": n_runs, "agent": study.experiments[condition].population.size}
    sizes |= {dim: len(values) for dim, values in coordinates.items()}
    return sum(memory.variable_bytes(assay.variables, sizes).values())
