"""How a study is brought to its runs and to its assays, showing how far it is."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from baldwinlab import console, presets
from baldwinlab.assays import ASSAYS, agent_steps, misfits, missing_assays, run_assays
from baldwinlab.errors import InterruptedStudyError, require_positive
from baldwinlab.experiment import Experiment
from baldwinlab.factors import CONDITIONS, Factors, Kind
from baldwinlab.models.miniworld.backend import Backend, choose
from baldwinlab.papers import Paper, keep
from baldwinlab.runs.simulate import check_seed
from baldwinlab.studies import executors, store
from baldwinlab.studies.executors import Executor, ExecutorError
from baldwinlab.studies.store import Study
from baldwinlab.studies.study import agent_steps_of_run, missing_runs, run_study


def bring(
    experiments: Sequence[Experiment],
    directory: Path,
    *,
    runs: int,
    seed: int,
    workers: int | None = None,
    backend: str = "auto",
    executor: str = "threads",
    paper: Paper | None = None,
    kind: Kind = CONDITIONS,
    factors: Mapping[str, Factors] | None = None,
) -> Study:
    """Make the study, that of a paper if one is given, or open the one that is there, and do the runs that it lacks.

    Unless `factors` are given, those of the conditions that bear a preset's name are the preset's.
    Raises ArgumentError for an argument beyond its limits and StudyError where the directory holds anything else, before
    anything is written; KeyboardInterrupt and InterruptedStudyError say what is stored when it is stopped.
    """
    require_positive("runs", runs)
    require_positive("workers", workers)
    place = executors.choose(executor, workers)
    check_seed(seed)
    engine = _engine(backend, place, runs, experiments)
    if factors is None:
        factors = paper.factors() if paper else presets.factors()
    study = store.create(directory, experiments, seed, kind, factors, paper=paper.name if paper else "")
    if paper:
        keep(paper, directory)
    missing = missing_runs(study, runs, console.complain)
    total = sum(agent_steps_of_run(study.experiments[condition]) * len(numbers) for condition, numbers in missing.items())
    wanted = runs * len(experiments)
    if not total:
        console.say(f"{directory}: runs: {wanted}, all of them stored already")
        return study
    stored = wanted - sum(map(len, missing.values()))
    console.say(f"{directory}: runs: {wanted}, stored already: {stored}, agent-steps to do: {total:,}")
    tasks = place.workers if engine.name != "cuda" else max(place.workers, len(experiments), 2)  # one lives, another breeds
    with _saying_where_it_stands(study, lambda: _standing(study, runs)):
        run_study(study, missing, tasks, console.progress, console.say, engine, place)
    return study


def _engine(name: str, place: Executor, runs: int, experiments: Sequence[Experiment]) -> Backend:
    """Whether there is a GPU here says nothing about workers elsewhere, and models that are parts live on the CPU alone."""
    foragers = all(isinstance(experiment, Experiment) for experiment in experiments)
    chosen = "cpu" if name == "auto" and not (foragers and place.name == "threads") else name
    return choose(chosen, runs * len(experiments), max(experiment.population.size for experiment in experiments))


def assay(study: Study, names: Sequence[str] = tuple(ASSAYS), *, workers: int | None = None, executor: str = "threads") -> None:
    """Do these assays of a study, as far as they are not stored; raises as `bring` does."""
    require_positive("workers", workers)
    place = executors.choose(executor, workers)
    study.require_parts()
    for sentence in misfits(study, names):
        console.say(sentence)
    missing = missing_assays(study, names)
    count = sum(map(len, missing.values()))
    if not count:
        console.say(f"{study.directory}: all of these assays are stored already")
        return
    console.say(f"{study.directory}: assays to do: {count}, agent-steps: {agent_steps(study, missing):,}")

    def standing() -> str:
        done = count - sum(map(len, missing_assays(study, names).values()))
        return f"assays done: {done} of {count}; the same command carries on"

    with _saying_where_it_stands(study, standing):
        run_assays(study, missing, place.workers, console.progress, console.say, place)


@contextmanager
def _saying_where_it_stands(study: Study, standing: Callable[[], str]) -> Iterator[None]:
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


def _standing(study: Study, runs: int) -> str:
    stored = sum(len(set(study.runs(condition)) & set(range(runs))) for condition in study.experiments)
    return f"runs stored in {study.directory}: {stored}; the same command carries on from there"
