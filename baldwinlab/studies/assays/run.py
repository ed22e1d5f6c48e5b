"""Run assays: simulate the genomes of a stored study again, and measure and store the results.

See docs/explanation/assays.md.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from baldwinlab._version import __version__
from baldwinlab.core import variables
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.experiment.conditions import find_control
from baldwinlab.experiment.toml import to_toml
from baldwinlab.models.miniworld.backends.choice import CPU, Backend
from baldwinlab.models.miniworld.backends.cpu import BLOCK_WORLDS
from baldwinlab.simulation.compilation import compile_experiments
from baldwinlab.studies.assays import Arrays, OnMap, Sample, list_other_maps
from baldwinlab.studies.assays.catalog import get_assay, get_assays
from baldwinlab.studies.assays.results import assay_path, encode_assay
from baldwinlab.studies.executors import THREADS, Executor
from baldwinlab.studies.open import sample_runs
from baldwinlab.studies.records import read_record, write_in_study
from baldwinlab.studies.run import Progress
from baldwinlab.studies.store import StudyStore


class AssayTask(NamedTuple):
    """Task that measures assays of some runs of one condition and returns the results."""

    experiment: Experiment
    runs: tuple[int, ...]
    names: tuple[str, ...]
    other_maps: tuple[OnMap, ...]
    agent_steps: int
    # No-learning control, if the study has one and an assay uses it.
    control: Experiment | None = None
    # Number of generations of branches; None for the default.
    generations: int | None = None

    @property
    def experiments(self) -> tuple[Experiment, ...]:
        on_maps = (experiment for _, experiment in self.other_maps)
        controls = [self.control] if self.control else []
        return (self.experiment, *on_maps, *controls)

    def run(
        self, seed: int, directory: Path, backend: Backend, report_progress: Callable[[int], None]
    ) -> dict[str, Arrays]:
        """Return the arrays of each assay. See `Task`."""

        def read_sample(experiment: Experiment) -> Sample:
            records = [read_record(directory, experiment, seed, run) for run in self.runs]
            return Sample(
                directory=directory,
                seed=seed,
                experiment=experiment,
                runs=self.runs,
                records=records,
                other_maps=self.other_maps,
                report_progress=report_progress,
            )

        sample = read_sample(self.experiment)
        if self.control:
            sample = replace(sample, control=read_sample(self.control))
        return {name: get_assay(name, self.generations).measure(sample) for name in self.names}


class TaskResults(NamedTuple):
    """A finished task, and the arrays of each of its assays."""

    task: AssayTask
    results: dict[str, Arrays]


def count_assay_steps(
    study: StudyStore, missing: Mapping[str, Sequence[str]], generations: int | None = None
) -> int:
    """Return the agent-steps of missing assays. `generations`: length of the branches of forks."""
    return sum(
        _agent_steps_of_run(study, condition, names, generations)
        * len(sample_runs(study, condition))
        for condition, names in missing.items()
    )


def _agent_steps_of_run(
    study: StudyStore, condition: str, names: Sequence[str], generations: int | None
) -> int:
    experiment = study.experiments[condition]
    lives = sum(get_assay(name, generations).plan(study, condition).n_lives for name in names)
    return lives * experiment.agent_steps


def _experiments_to_compile(
    study: StudyStore, missing: Mapping[str, Sequence[str]]
) -> Iterator[BaseExperiment]:
    """Yield the experiments that the engine must compile for missing assays."""
    for condition, names in missing.items():
        if not names:
            continue
        experiment = study.experiments[condition]
        yield experiment
        if experiment.learns:
            yield experiment.without_learning()
        for assay in get_assays(names):
            yield from assay.variants(experiment)
        if control := _find_used_control(study, condition, names):
            yield control


def _find_used_control(
    study: StudyStore, condition: str, names: Sequence[str]
) -> Experiment | None:
    """Return the no-learning control, if the study has it and one of the assays uses it."""
    if not any(assay.uses_control for assay in get_assays(names)):
        return None
    return study.experiments.get(find_control(condition, study.experiments))


def run_assays(
    study: StudyStore,
    missing: Mapping[str, Sequence[str]],
    workers: int,
    progress: Callable[[str, int], Progress],
    log: Callable[[str], None],
    *,
    executor: Executor = THREADS,
    generations: int | None = None,
) -> None:
    """Measure the missing assays in parallel, and store a condition when all its runs are done.

    The results do not depend on the executor and the number of workers. Stored results remain if
    the process is interrupted. Raises `StudyError` if the simulation of a stored generation gives a
    different energy. `missing`: names of assays by condition. `progress`: see `run_study`.
    """
    study.require_parts(*(condition for condition, names in missing.items() if names))
    study.sweep()
    compile_seconds = compile_experiments(_experiments_to_compile(study, missing), log=log)
    log(f"Engine ready after {compile_seconds:.1f} s.")
    tasks = _plan_tasks(study, missing, workers, generations)
    n_unfinished = Counter(task.experiment.name for task in tasks)
    measured: dict[str, list[TaskResults]] = {condition: [] for condition in n_unfinished}

    def store_complete_condition(task: AssayTask, results: dict[str, Arrays]) -> None:
        condition = task.experiment.name
        measured[condition].append(TaskResults(task, results))
        n_unfinished[condition] -= 1
        if n_unfinished[condition] == 0:
            _store_results(study, condition, measured.pop(condition), generations)

    with (
        progress("simulating", sum(task.agent_steps for task in tasks)) as show_progress,
        closing(executor.run(study, tasks, workers, CPU, store_complete_condition)) as increments,
    ):
        for agent_steps in increments:
            show_progress(agent_steps)


def _plan_tasks(
    study: StudyStore, missing: Mapping[str, Sequence[str]], workers: int, generations: int | None
) -> list[AssayTask]:
    """Divide the runs into tasks, with the slow tasks (agents that learn) first."""
    total_runs = sum(len(sample_runs(study, condition)) for condition in missing)
    runs_per_task = max(1, min(BLOCK_WORLDS, total_runs // workers))
    learners_first = sorted(missing, key=lambda name: not study.experiments[name].learns)
    tasks: list[AssayTask] = []
    for condition in learners_first:
        names = tuple(missing[condition])
        if not names:
            continue
        runs = sample_runs(study, condition)
        steps_per_run = _agent_steps_of_run(study, condition, names, generations)
        uses_maps = any(assay.uses_other_maps for assay in get_assays(names))
        maps = list_other_maps(study, condition) if uses_maps else ()
        control = _find_used_control(study, condition, names)
        for start in range(0, len(runs), runs_per_task):
            task_runs = tuple(runs[start : start + runs_per_task])
            task = AssayTask(
                experiment=study.experiments[condition],
                runs=task_runs,
                names=names,
                other_maps=maps,
                agent_steps=steps_per_run * len(task_runs),
                control=control,
                generations=generations,
            )
            tasks.append(task)
    return tasks


def _store_results(
    study: StudyStore, condition: str, measured: list[TaskResults], generations: int | None
) -> None:
    """Concatenate the results of a condition, sorted by run, and store each assay."""
    measured.sort(key=lambda task_results: task_results.task.runs)
    # All tasks of a condition have the same assays.
    names = measured[0].task.names
    runs = np.array([run for task, _ in measured for run in task.runs], np.int32)
    agents = np.arange(study.experiments[condition].population.size, dtype=np.int32)
    for name in names:
        assay = get_assay(name, generations)
        arrays = {
            variable: np.concatenate([results[name][variable] for _, results in measured])
            for variable in assay.variables
        }
        attributes: dict[str, Any] = {
            "condition": condition,
            "seed": study.seed,
            "experiment": to_toml(study.experiments[condition]),
            "baldwinlab": __version__,
        }
        if assay.uses_control:
            attributes |= _describe_control(study, condition)
        attributes |= assay.attributes
        data = variables.make_dataset(assay.variables, arrays, attributes)
        data = data.assign_coords(run=runs)
        data = data.assign_coords(assay.plan(study, condition).coordinates)
        if "agent" in data.dims:
            data = data.assign_coords(agent=agents)
        path = assay_path(study.directory, name, condition)
        write_in_study(study.directory, path, encode_assay(data))


def _describe_control(study: StudyStore, condition: str) -> dict[str, Any]:
    """Return attributes with the name and experiment of the control; without it, the name is ""."""
    control = find_control(condition, study.experiments)
    experiment = (
        study.experiments[control] if control else study.experiments[condition].without_learning()
    )
    return {"control": control, "control_experiment": to_toml(experiment)}
