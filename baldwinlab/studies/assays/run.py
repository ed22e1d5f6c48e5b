"""Assays: what is measured on a stored study by living its genomes again; docs/explanation/assays.md."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt
import xarray as xr

from baldwinlab._version import __version__
from baldwinlab.core import variables
from baldwinlab.core.files import parse_location
from baldwinlab.core.netcdf import to_bytes
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.experiment.toml import to_toml
from baldwinlab.models.miniworld.backends.choice import CPU, Backend
from baldwinlab.simulation.compilation import compile_experiments
from baldwinlab.studies.assays import (
    descent,
    innate,
    modules,
    neutral,
    reaction_norms,
    within_life,
)
from baldwinlab.studies.assays.sample import Conditions, OnMap, Sample
from baldwinlab.studies.assays.storage import FORMAT, assay_path, read_assay
from baldwinlab.studies.executors import THREADS, Executor
from baldwinlab.studies.records import StudyError, read_record, write_in_study
from baldwinlab.studies.run import Progress
from baldwinlab.studies.store import StudyStore

Arrays = Mapping[str, npt.NDArray[Any]]


class Assay(Protocol):
    """A file of this folder."""

    def coordinates(self, study: Conditions, condition: str) -> Mapping[str, Any]:
        """The coordinates of its dataset, but for runs and agents."""

    def count_lives(self, study: Conditions, condition: str) -> int:
        """How many generations it lives again of each run."""

    def measure(self, sample: Sample) -> Arrays:
        """Its variables as `variables.ASSAYS` declares them."""


ASSAYS: Mapping[str, Assay] = {
    "innate": innate,
    "neutral": neutral,
    "within-life": within_life,
    "modules": modules,
    "reaction": reaction_norms,
    "descent": descent,
}


class AssayTask(NamedTuple):
    """A task: assays of some runs of one condition, which are given back."""

    experiment: Experiment
    runs: tuple[int, ...]
    names: tuple[str, ...]
    elsewhere: tuple[OnMap, ...]
    agent_steps: int

    @property
    def experiments(self) -> tuple[Experiment, ...]:
        return (self.experiment, *(experiment for _, experiment in self.elsewhere))

    def run(
        self, seed: int, directory: Path, backend: Backend, lived: Callable[[int], None]
    ) -> dict[str, Arrays]:
        """What each assay measured. See `Task`."""
        records = [read_record(directory, self.experiment, seed, run) for run in self.runs]
        sample = Sample(directory, seed, self.experiment, self.runs, records, self.elsewhere, lived)
        return {name: ASSAYS[name].measure(sample) for name in self.names}


def why_not_applicable(name: str, experiment: BaseExperiment) -> str:
    """Why an assay has nothing to measure of an experiment, in a sentence; empty where it has."""
    if experiment.births_in_life and name != "descent":  # which lives nobody again
        return f"the assay {name} is of whole lives of stored genomes, and where agents are born in mid-life others replace them"
    if name in ("innate", "descent"):
        return ""  # which ask through a model's switch, or through its pedigree, alone
    if name == "neutral":  # and this through both switches
        if experiment.evolution.inheritance == "none":
            return "the assay neutral is of what selection builds, and where nothing is inherited it builds nothing"
        drawn = experiment.evolution.selection == "neutral"
        return (
            "the assay neutral is of what selection builds, and parents at random are their own neutral twin"
            if drawn
            else ""
        )
    if name == "modules":  # and this through the genome's
        there = "reinforcement" in experiment.modules
        return "" if there else "the assay modules is of agents with a reinforcement module"
    if not isinstance(experiment, Experiment):
        return f"the assay {name} is of foragers and what they eat, so the model {experiment.model} has none"
    return ""


def not_applicable_reasons(study: StudyStore, names: Sequence[str]) -> list[str]:
    """Why assays have nothing to measure of some conditions, each sentence once."""
    _require_assay_names(names)
    found = (
        why_not_applicable(name, experiment)
        for experiment in study.experiments.values()
        for name in names
    )
    return [sentence for sentence in dict.fromkeys(found) if sentence]


def is_stored(name: str, study: StudyStore, condition: str) -> bool:
    """Whether there is a file of what an assay measured of a condition."""
    return assay_path(study.directory, name, condition).exists()


def open_assay(directory: str | Path, assay: str, condition: str) -> xr.Dataset:
    """Return the stored results of an assay of one condition.

    Parameters
    ----------
    directory
        The directory of a study, or a URL that fsspec can open.
    assay
        "innate", "neutral", "within-life", "modules", "reaction" or "descent".
    condition
        Name of a condition.

    Returns
    -------
    xarray.Dataset
        The variables of `baldwinlab.core.variables.ASSAYS[assay]`.

    Raises
    ------
    StudyError
        There is no such study, assay or condition, the assay has not been run, or its file is damaged.
    """
    study = StudyStore(parse_location(directory))
    _require_assay_names([assay])
    study.experiment(condition)
    path = assay_path(study.directory, assay, condition)
    if not path.exists():
        again = f"baldwinlab assay {directory} --assays {assay}"
        why = why_not_applicable(assay, study.experiment(condition))
        raise StudyError(f"{path} does not exist{f': {why}' if why else f'; `{again}` makes it'}")
    try:
        return read_assay(study, assay, condition)
    except OSError as error:
        raise StudyError(f"{path} cannot be read: {error.strerror or error}") from None
    except ValueError as error:
        raise StudyError(str(error)) from None


def find_missing_assays(study: StudyStore, names: Sequence[str]) -> dict[str, list[str]]:
    """The assays that are still to do, by condition: those whose files are not there, or do not fit the stored runs.

    Raises StudyError for an unknown assay, and for a study without any run.
    """
    _require_assay_names(names)
    study.require_runs()
    return {
        condition: [
            name
            for name in names
            if not (_is_done(study, name, condition) or why_not_applicable(name, experiment))
        ]
        for condition, experiment in study.experiments.items()
        if study.runs(condition)
    }


def count_assay_steps(study: StudyStore, missing: Mapping[str, Sequence[str]]) -> int:
    """How much is to live for these assays."""
    return sum(
        _agent_steps_of_run(study, condition, names) * len(study.runs(condition))
        for condition, names in missing.items()
    )


def _agent_steps_of_run(study: StudyStore, condition: str, names: Sequence[str]) -> int:
    experiment = study.experiments[condition]
    lives = sum(ASSAYS[name].count_lives(study, condition) for name in names)
    return lives * experiment.steps * experiment.population.size


def _experiments_to_compile(
    study: StudyStore, missing: Mapping[str, Sequence[str]]
) -> Iterator[BaseExperiment]:
    """Yield the experiments that the engine must compile for these assays."""
    for experiment in (
        study.experiments[condition] for condition, names in missing.items() if names
    ):
        yield experiment
        if experiment.learns:
            yield experiment.without_learning()
            if "innate" in missing[experiment.name] and innate.drift_generations(experiment):
                yield innate.with_drift(experiment)
        if "neutral" in missing[experiment.name]:
            yield experiment.neutral_control()


def run_assays(
    study: StudyStore,
    missing: Mapping[str, Sequence[str]],
    workers: int,
    progress: Callable[[str, int], Progress],
    tell: Callable[[str], None],
    executor: Executor = THREADS,
) -> None:
    """Measure the missing assays, so many batches of runs at a time, and store those of a condition when all its runs are done.

    `progress(description, total)` opens what is called with the agent-steps that have been lived.
    The result does not depend on where it is done, nor by how many. What is stored when this is stopped stays. Raises
    DamagedRecordError for a record that is not what was written, and StudyError for one that cannot be lived again to the same
    bits.
    """
    study.require_parts(*(condition for condition, names in missing.items() if names))
    study.sweep()
    compile_seconds = compile_experiments(_experiments_to_compile(study, missing), log=tell)
    tell(f"Engine ready after {compile_seconds:.1f} s.")
    tasks = _plan(study, missing, workers)
    left = Counter(task.experiment.name for task in tasks)
    measured: dict[str, list[tuple[AssayTask, dict[str, Arrays]]]] = {
        condition: [] for condition in left
    }

    def done(task: AssayTask, found: dict[str, Arrays]) -> None:
        condition = task.experiment.name
        measured[condition].append((task, found))
        left[condition] -= 1
        if not left[condition]:
            _store(study, condition, measured.pop(condition))

    with (
        progress("simulating", sum(task.agent_steps for task in tasks)) as show,
        closing(executor.run(study, tasks, workers, CPU, done)) as amounts,
    ):
        for amount in amounts:
            show(amount)


def _plan(study: StudyStore, missing: Mapping[str, Sequence[str]], workers: int) -> list[AssayTask]:
    """Batches of runs, those that learn first, because they are slow, so that no worker is left with one at the end."""
    total = sum(len(study.runs(condition)) for condition in missing)
    size = max(1, min(CPU.worlds, total // workers))
    return [
        task
        for condition in sorted(missing, key=lambda name: not study.experiments[name].learns)
        if missing[condition]
        for task in _batches(study, condition, tuple(missing[condition]), size)
    ]


def _batches(
    study: StudyStore, condition: str, names: tuple[str, ...], size: int
) -> Iterator[AssayTask]:
    """All runs of a condition, so many in a task."""
    runs, of_run = study.runs(condition), _agent_steps_of_run(study, condition, names)
    elsewhere = reaction_norms.other_maps(study, condition) if "reaction" in names else ()
    for first in range(0, len(runs), size):
        batch = tuple(runs[first : first + size])
        yield AssayTask(study.experiments[condition], batch, names, elsewhere, of_run * len(batch))


def _store(
    study: StudyStore, condition: str, measured: list[tuple[AssayTask, dict[str, Arrays]]]
) -> None:
    """Put the runs of a condition together, in whatever order they were done, and write each assay."""
    measured.sort(key=lambda one: one[0].runs)
    names = measured[0][0].names
    runs = np.array([run for task, _ in measured for run in task.runs], np.int32)
    agents = np.arange(study.experiments[condition].population.size, dtype=np.int32)
    for name in names:
        declared = variables.ASSAYS[name]
        arrays = {
            variable: np.concatenate([found[name][variable] for _, found in measured])
            for variable in declared
        }
        found = variables.dataset(declared, arrays, _provenance(study, condition)).assign_coords(
            run=runs
        )
        found = found.assign_coords(ASSAYS[name].coordinates(study, condition))
        if "agent" in found.dims:
            found = found.assign_coords(agent=agents)
        write_in_study(
            study.directory,
            assay_path(study.directory, name, condition),
            to_bytes(found.assign_attrs(format=FORMAT)),
        )


def _provenance(study: StudyStore, condition: str) -> dict[str, Any]:
    experiment = to_toml(study.experiments[condition])
    return {
        "condition": condition,
        "seed": study.seed,
        "experiment": experiment,
        "baldwinlab": __version__,
    }


def _is_done(study: StudyStore, name: str, condition: str) -> bool:
    """Whether an assay is stored, of the same runs of the same experiment, by this version."""
    try:
        found = read_assay(study, name, condition)
    except (OSError, ValueError):
        return False
    same = (
        found.attrs.get("condition") == condition and found.attrs.get("baldwinlab") == __version__
    )
    return same and found.run.values.tolist() == study.runs(condition)


def _require_assay_names(names: Sequence[str]) -> None:
    for name in names:
        if name not in ASSAYS:
            raise StudyError(f"there is no assay {name!r}; there are {', '.join(ASSAYS)}")
