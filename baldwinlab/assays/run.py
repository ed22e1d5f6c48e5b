"""Assays: what is measured on a stored study by living its genomes again. Nothing is evolved; docs/assays.md."""

from __future__ import annotations

import threading
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt
import xarray as xr

from baldwinlab import variables
from baldwinlab.assays import descent, innate, modules, reaction, within_life
from baldwinlab.assays.sample import Sample
from baldwinlab.assays.stored import in_words_of_today
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.experiment.toml import to_toml
from baldwinlab.files import location, write_atomically
from baldwinlab.models.miniworld.backend import CPU
from baldwinlab.runs.warm_up import warm_up
from baldwinlab.studies.executors.tasks import StoppedError
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import Study
from baldwinlab.studies.study import Progress
from baldwinlab.version import __version__

Arrays = Mapping[str, npt.NDArray[Any]]


class Assay(Protocol):
    """A file of this folder."""

    def coords(self, study: Study, condition: str) -> Mapping[str, Any]:
        """The coordinates of its dataset, but for runs and agents."""

    def lives(self, study: Study, condition: str) -> int:
        """How many generations it lives again of each run."""

    def measure(self, sample: Sample) -> Arrays:
        """Its variables as `variables.ASSAYS` declares them."""


ASSAYS: Mapping[str, Assay] = {
    "innate": innate,
    "within-life": within_life,
    "modules": modules,
    "reaction": reaction,
    "descent": descent,
}


class Task(NamedTuple):
    """Assays of some runs of a condition."""

    condition: str
    runs: tuple[int, ...]
    names: tuple[str, ...]


def misfit(name: str, experiment: BaseExperiment) -> str:
    """Why an assay has nothing to measure of an experiment, in a sentence; empty where it has."""
    if name in ("innate", "descent"):
        return ""  # which ask through a model's switches, or through its pedigree, alone
    if not isinstance(experiment, Experiment):
        return f"the assay {name} is of foragers and what they eat, so the model {experiment.model} has none"
    if name == "modules" and len(experiment.modules) == 1:
        return "the assay modules is of agents with a reinforcement module"
    return ""


def misfits(study: Study, names: Sequence[str]) -> list[str]:
    """Why assays have nothing to measure of conditions of other models, a sentence each."""
    _require_known(names)
    others = {one.model: one for one in study.experiments.values() if not isinstance(one, Experiment)}
    return [sentence for one in others.values() for name in names if (sentence := misfit(name, one))]


def is_stored(name: str, study: Study, condition: str) -> bool:
    """Whether there is a file of what an assay measured of a condition."""
    return _path(study, name, condition).exists()


def open_assay(directory: str | Path, assay: str, condition: str) -> xr.Dataset:
    """What an assay measured of a condition: the variables of `baldwinlab.variables.ASSAYS[assay]`.

    Raises StudyError for an assay or a condition that there is not, for one that has not been measured yet, and for a file
    that cannot be read.
    """
    study = Study(location(directory))
    _require_known([assay])
    study.experiment(condition)
    path = _path(study, assay, condition)
    if not path.exists():
        again = f"baldwinlab assay {directory} --only {assay}"
        why = misfit(assay, study.experiment(condition))
        raise StudyError(f"{path} does not exist{f': {why}' if why else f'; `{again}` makes it'}")
    try:
        return in_words_of_today(variables.from_netcdf(path.read_bytes()))
    except (OSError, ValueError, TypeError) as error:
        raise StudyError(f"{path} cannot be read: {error}") from None


def missing_assays(study: Study, names: Sequence[str]) -> dict[str, list[str]]:
    """The assays that are still to do, by condition: those whose files are not there, or do not fit the stored runs.

    Raises StudyError for an unknown assay, and for a study without any run.
    """
    _require_known(names)
    study.require_runs()
    return {
        condition: [name for name in names if not (_is_done(study, name, condition) or misfit(name, experiment))]
        for condition, experiment in study.experiments.items()
        if study.runs(condition)
    }


def agent_steps(study: Study, missing: Mapping[str, Sequence[str]]) -> int:
    """How much is to live for these assays."""
    return sum(
        ASSAYS[name].lives(study, condition)
        * len(study.runs(condition))
        * study.experiments[condition].steps
        * study.experiments[condition].population.size
        for condition, names in missing.items()
        for name in names
    )


def _ways_of_living(study: Study) -> Iterator[BaseExperiment]:
    """The conditions as they evolved, and with the learner off."""
    for experiment in study.experiments.values():
        yield experiment
        if experiment.learns:
            yield experiment.without_learner()


def run_assays(
    study: Study,
    missing: Mapping[str, Sequence[str]],
    workers: int,
    progress: Callable[[str, int], Progress],
    tell: Callable[[str], None],
) -> None:
    """Measure the missing assays, batches of runs on threads, and store those of a condition when all its runs are done.

    `progress(description, total)` opens what is called with the agent-steps that have been lived.
    The result does not depend on the number of workers. What is stored when this is stopped stays. Raises DamagedRecordError
    for a record that is not what was written, and StudyError for one that cannot be lived again to the same bits.
    """
    study.require_parts(*(condition for condition, names in missing.items() if names))
    study.sweep()
    compile_seconds = warm_up(_ways_of_living(study))
    tell(f"the engine is ready: {compile_seconds:.1f} s to compile it, or to load it as it was compiled before")
    stop, lock = threading.Event(), threading.Lock()
    tasks = _plan(study, missing, workers)
    with progress("living again", agent_steps(study, missing)) as show, ThreadPoolExecutor(workers) as pool:

        def lived(amount: int) -> None:
            if stop.is_set():
                raise StoppedError
            with lock:
                show(amount)

        futures = {pool.submit(_measure, study, task, lived): task for task in tasks}
        try:
            for condition in _complete(futures):
                done = [(task, future.result()) for future, task in futures.items() if task.condition == condition]
                _store(study, condition, done)
        finally:
            stop.set()
            pool.shutdown(wait=True, cancel_futures=True)


def _plan(study: Study, missing: Mapping[str, Sequence[str]], workers: int) -> list[Task]:
    """Batches of runs, those that learn first, because they are slow, so that no worker is left with one at the end."""
    total = sum(len(study.runs(condition)) for condition in missing)
    size = max(1, min(CPU.worlds, total // workers))
    return [
        Task(condition, tuple(runs[first : first + size]), tuple(missing[condition]))
        for condition in sorted(missing, key=lambda name: not study.experiments[name].learns)
        if missing[condition]
        for runs in [study.runs(condition)]
        for first in range(0, len(runs), size)
    ]


def _measure(study: Study, task: Task, lived: Callable[[int], None]) -> dict[str, Arrays]:
    records = [study.read(task.condition, run) for run in task.runs]
    sample = Sample(study, study.experiments[task.condition], task.runs, records, lived)
    return {name: ASSAYS[name].measure(sample) for name in task.names}


def _complete(futures: Mapping[Future[dict[str, Arrays]], Task]) -> Iterator[str]:
    """Conditions, as their last task ends. Raises what a task raised."""
    left = [task.condition for task in futures.values()]
    for future in as_completed(futures):
        future.result()
        condition = futures[future].condition
        left.remove(condition)
        if condition not in left:
            yield condition


def _store(study: Study, condition: str, measured: Sequence[tuple[Task, dict[str, Arrays]]]) -> None:
    """Put the runs of a condition together, and write each assay."""
    names = measured[0][0].names
    runs = np.array([run for task, _ in measured for run in task.runs], np.int32)
    agents = np.arange(study.experiments[condition].population.size, dtype=np.int32)
    for name in names:
        declared = variables.ASSAYS[name]
        arrays = {variable: np.concatenate([found[name][variable] for _, found in measured]) for variable in declared}
        found = variables.dataset(declared, arrays, _provenance(study, condition)).assign_coords(run=runs)
        found = found.assign_coords(ASSAYS[name].coords(study, condition))
        if "agent" in found.dims:
            found = found.assign_coords(agent=agents)
        write_atomically(_path(study, name, condition), bytes(found.to_netcdf(engine="scipy")))


def _provenance(study: Study, condition: str) -> dict[str, Any]:
    experiment = to_toml(study.experiments[condition])
    return {"condition": condition, "seed": study.seed, "experiment": experiment, "baldwinlab": __version__}


def _path(study: Study, name: str, condition: str) -> Path:
    return study.directory / "assays" / name / f"{condition}.nc"


def _is_done(study: Study, name: str, condition: str) -> bool:
    """Whether an assay is stored, of the same runs of the same experiment, by this version."""
    try:
        found = open_assay(study.directory, name, condition)
    except StudyError:
        return False
    there, wanted = dict(found.attrs), _provenance(study, condition)
    same = tomllib.loads(there.pop("experiment", "")) == tomllib.loads(wanted.pop("experiment"))  # comments come from its parts
    return same and found.run.values.tolist() == study.runs(condition) and there == wanted


def _require_known(names: Sequence[str]) -> None:
    for name in names:
        if name not in ASSAYS:
            raise StudyError(f"there is no assay {name!r}; there are {', '.join(ASSAYS)}")
