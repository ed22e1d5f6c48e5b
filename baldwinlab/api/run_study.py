"""How a study is brought to its runs and to its assays, showing how far it is."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

from baldwinlab.core import console, variables
from baldwinlab.core.errors import ArgumentError, InterruptedStudyError, require_positive
from baldwinlab.core.files import require_place, write_atomically
from baldwinlab.core.output_paths import is_study
from baldwinlab.core.resources import NOTHING, Need, require
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.factors import CONDITIONS, Factors, Kind
from baldwinlab.models.miniworld.backends.choice import Backend, choose
from baldwinlab.papers import Paper, keep, presets
from baldwinlab.simulation import memory
from baldwinlab.simulation.simulate import check_seed
from baldwinlab.studies import executors, store
from baldwinlab.studies.assays.memory import need as of_assays
from baldwinlab.studies.assays.run import agent_steps, misfits, missing_assays, run_assays
from baldwinlab.studies.assays.storage import assay_path
from baldwinlab.studies.executors import THREADS, Executor, ExecutorError
from baldwinlab.studies.records import MOST_RUNS
from baldwinlab.studies.run import agent_steps_of_run, missing_runs, run_study
from baldwinlab.studies.store import StudyStore


class How(NamedTuple):
    """How lives are lived, which decides no bit of what comes of them; `workers` are all cores unless given."""

    workers: int | None = None
    backend: str = "auto"
    executor: str = "threads"
    force: bool = False

    def place(self) -> Executor:
        require_positive("workers", self.workers)
        return executors.choose(self.executor, self.workers)


def bring(
    experiments: Sequence[Experiment],
    directory: Path,
    how: How,
    *,
    runs: int,
    seed: int,
    paper: Paper | None = None,
    changes: Sequence[str] = (),
    kind: Kind = CONDITIONS,
    factors: Mapping[str, Factors] | None = None,
    beside: Mapping[str, bytes] = MappingProxyType({}),
    afterwards: Need = NOTHING,
) -> StudyStore:
    """Make the study, that of a paper if one is given, or open the one that is there, and do the runs that it lacks.

    Unless `factors` are given, those of the conditions that bear a preset's name are the preset's. `beside` are files that the
    directory is to hold, too. `afterwards` is what the caller needs for what comes after the runs.
    Raises ArgumentError for an argument beyond its limits, RefusedError for more memory or disk than is free (unless forced),
    and StudyError where the directory holds anything else, before anything is written; KeyboardInterrupt and
    InterruptedStudyError say what is stored when it is stopped.
    """
    require_positive("runs", runs)
    if runs > MOST_RUNS:
        raise ArgumentError("runs", runs, f"must be at most {MOST_RUNS}")
    place = how.place()
    check_seed(seed)
    engine = _engine(how.backend, place, runs, experiments)
    tasks = (
        place.workers if engine.name != "cuda" else max(place.workers, len(experiments), 2)
    )  # one lives, another breeds
    need = _of_runs(experiments, directory, runs, tasks, engine, place).then(afterwards)
    require(f"runs: {runs * len(experiments):,}", need, directory, force=how.force)
    for experiment in experiments:
        memory.require_storable(
            variables.of_record(experiment), memory.sizes(experiment), experiment.name
        )
    if factors is None:
        factors = paper.factors() if paper else presets.factors()
    study = store.create(
        directory,
        experiments,
        seed,
        kind,
        factors,
        paper=paper.name if paper else "",
        changes=changes,
    )
    if paper:
        keep(paper, directory)
    for name, content in beside.items():
        write_atomically(directory / name, content)
    missing = missing_runs(study, runs, console.warn)
    total = sum(
        agent_steps_of_run(study.experiments[condition]) * len(numbers)
        for condition, numbers in missing.items()
    )
    wanted = runs * len(experiments)
    if not total:
        console.info(f"{directory}: runs: {wanted}, all of them stored already")
        return study
    study.require_writable(
        study.path(condition, lacking[0]) for condition, lacking in missing.items() if lacking
    )
    stored = wanted - sum(map(len, missing.values()))
    console.info(
        f"{directory}: runs: {wanted}, stored already: {stored}, agent-steps to do: {total:,}"
    )
    with _saying_where_it_stands(study, lambda: _standing(study, runs)):
        run_study(study, missing, tasks, console.progress, console.info, engine, place)
    return study


def _of_runs(
    experiments: Sequence[Experiment],
    directory: Path,
    runs: int,
    workers: int,
    engine: Backend,
    place: Executor,
) -> Need:
    """What the runs take that the directory lacks."""
    there = is_study(directory)
    lacking = []
    for experiment in experiments:
        stored = sum(1 for _ in (directory / "runs" / experiment.name).glob("*.nc")) if there else 0
        lacking.append((experiment, max(0, runs - stored)))
    return _here(memory.of_runs(lacking, workers, engine.worlds), place)


def _here(need: Need, place: Executor) -> Need:
    """What of it is this machine's to give: elsewhere than on threads, the memory is others'."""
    return need if place.name == THREADS.name else need._replace(memory=0)


def _engine(name: str, place: Executor, runs: int, experiments: Sequence[Experiment]) -> Backend:
    """Whether there is a GPU here says nothing about workers elsewhere, and models that are parts live on the CPU alone."""
    foragers = all(isinstance(experiment, Experiment) for experiment in experiments)
    chosen = "cpu" if name == "auto" and not (foragers and place.name == "threads") else name
    return choose(
        chosen,
        runs * len(experiments),
        max(experiment.population.size for experiment in experiments),
    )


def assay(study: StudyStore, names: Sequence[str], how: How) -> None:
    """Do these assays of a study, as far as they are not stored, on the CPU whatever the backend; raises as `bring` does."""
    place = how.place()
    study.require_parts()
    for sentence in misfits(study, names):
        console.info(sentence)
    missing = missing_assays(study, names)
    count = sum(map(len, missing.values()))
    if not count:
        console.info(f"{study.directory}: all of these assays are stored already")
        return
    for condition, lacking in missing.items():
        for name in lacking:
            require_place(assay_path(study.directory, name, condition))
    need = of_assays(
        study,
        missing,
        {condition: len(study.runs(condition)) for condition in missing},
        place.workers,
    )
    require(f"assays: {count}", _here(need, place), study.directory, force=how.force)
    console.info(
        f"{study.directory}: assays to do: {count}, agent-steps: {agent_steps(study, missing):,}"
    )

    def standing() -> str:
        done = count - sum(map(len, missing_assays(study, names).values()))
        return (
            f"{done} of {count} assays are stored and kept; an unfinished assay is not stored, and the "
            "same command measures it from its beginning"
        )

    with _saying_where_it_stands(study, standing):
        run_assays(study, missing, place.workers, console.progress, console.info, place)


@contextmanager
def _saying_where_it_stands(study: StudyStore, standing: Callable[[], str]) -> Iterator[None]:
    """Whatever stops the work, its message says how much of it is stored."""
    try:
        yield
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"stopped; {standing()}") from None
    except ExecutorError as error:
        raise InterruptedStudyError(f"{error}; {standing()}") from None
    except OSError as error:
        fault = f"cannot write {error.filename or study.directory}: {error.strerror or error}"
        raise InterruptedStudyError(f"{fault}; {standing()}") from None


def _standing(study: StudyStore, runs: int) -> str:
    stored = sum(
        len(set(study.runs(condition)) & set(range(runs))) for condition in study.experiments
    )
    wanted = runs * len(study.experiments)
    return (
        f"{stored} of {wanted} runs are stored in {study.directory} and kept; an unfinished run is not "
        "stored, and the same command simulates it from its first generation"
    )
