"""What the commands share: the application, its options, and how a study is brought to its runs and to its report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any

from cyclopts import App, CycloptsError, Parameter, Token

from baldwinlab import console
from baldwinlab.experiment import Experiment
from baldwinlab.factors import CONDITIONS, MULTIVERSE, Factors, Kind
from baldwinlab.files import location
from baldwinlab.models.miniworld.backend import choose
from baldwinlab.multiverse.publish import publish as publish_multiverse
from baldwinlab.multiverse.section import combinations, verdict
from baldwinlab.publish import publish
from baldwinlab.runs.simulate import SEED_LIMIT
from baldwinlab.studies import executors, store
from baldwinlab.studies.executors import ExecutorError
from baldwinlab.studies.store import Study
from baldwinlab.studies.study import agent_steps_of_run, missing_runs, run_study
from baldwinlab.version import __version__


def _location(kind: object, tokens: Sequence[Token]) -> Path:
    return location(tokens[0].value)


app = App(
    name="baldwinlab",
    help="A laboratory for evolution x lifetime learning.",
    version=__version__,
    error_formatter=lambda error: f"baldwinlab: {_plain(error)}",
    error_console=console.errors,
    suppress_keyboard_interrupt=False,
)

Runs = Annotated[int, Parameter(help="independent runs of each condition")]
Seed = Annotated[int, Parameter(help="the seed that all randomness comes from")]
Workers = Annotated[int | None, Parameter(help="threads, all cores unless given; with --executor slurm, jobs")]
Directory = Annotated[Any, Parameter(converter=_location)]  # a Path; or what fsspec makes of a URL, which is none by type
Out = Annotated[Any, Parameter(converter=_location, help="directory of the study, or a URL such as s3://BUCKET/STUDY")]
BackendName = Annotated[str, Parameter(name="--backend", help="cpu, cuda, or auto for the fastest there is")]
Executor = Annotated[str, Parameter(name="--executor", help="threads, dask:tcp://HOST:PORT, or slurm")]
Last = Annotated[int, Parameter(help="a run counts with its average over so many last generations")]
Assignments = Annotated[list[str] | None, Parameter(name="--set", consume_multiple=True, help="change a field: path=value")]


def _plain(error: CycloptsError) -> str:
    return " ".join(str(error).split())


def bring(
    experiments: Sequence[Experiment],
    runs: int,
    seed: int,
    workers: int | None,
    directory: Path,
    backend_name: str,
    executor_name: str = "threads",
    kind: Kind = CONDITIONS,
    factors: Mapping[str, Factors] = MappingProxyType({}),
) -> Study:
    """Bring a study to the given number of runs, showing how far it is. `kind` and `factors` are as `store.create` takes them."""
    require_positive("--runs", runs)
    if workers is not None:
        require_positive("--workers", workers)
    executor = executors.choose(executor_name, workers)
    if not 0 <= seed < SEED_LIMIT:
        raise ValueError(f"--seed {seed} must be at least 0 and less than {SEED_LIMIT}")
    if executor.name != "threads" and backend_name == "auto":
        backend_name = "cpu"  # whether there is a GPU here says nothing about the workers
    backend = choose(backend_name, runs * len(experiments), max(experiment.population.size for experiment in experiments))
    workers = executor.workers
    if backend.name == "cuda":
        workers = max(workers, len(experiments), 2)  # one block lives while the children of another are bred
    study = store.create(directory, experiments, seed, kind, factors)
    missing = missing_runs(study, runs, console.complain)
    total = sum(agent_steps_of_run(study.experiments[condition]) * len(numbers) for condition, numbers in missing.items())
    wanted = runs * len(experiments)
    if not total:
        console.say(f"{directory}: runs: {wanted}, all of them stored already")
        return study
    stored = wanted - sum(map(len, missing.values()))
    console.say(f"{directory}: runs: {wanted}, stored already: {stored}, agent-steps to do: {total:,}")
    try:
        run_study(study, missing, workers, console.progress, console.say, backend, executor)
    except KeyboardInterrupt:
        raise InterruptedStudyError(f"stopped; {_standing(study, runs)}", code=130) from None
    except ExecutorError as error:
        raise InterruptedStudyError(f"{error}; {_standing(study, runs)}", code=1) from None
    except OSError as error:
        raise InterruptedStudyError(
            f"cannot write {error.filename or directory}: {error.strerror or error}; {_standing(study, runs)}", code=1
        ) from None
    return study


def require_positive(name: str, value: int) -> None:
    if value < 1:
        raise ValueError(f"{name} {value} must be at least 1")


def _standing(study: Study, runs: int) -> str:
    stored = sum(len(set(study.runs(condition)) & set(range(runs))) for condition in study.experiments)
    return f"runs stored in {study.directory}: {stored}; the same command carries on from there"


def make_report(study: Study, out: Path, last: int) -> None:
    """Bring the results of a study, or of a multiverse, on the page and on the screen."""
    if study.kind == MULTIVERSE:
        multiverse = publish_multiverse(study, out, last, console.progress, console.say)
        console.console.print(console.readings_table(multiverse))
        for sentence in (*verdict(multiverse.singles), *combinations(multiverse)):
            console.say(f"- {sentence}")
        console.say(f"report: {out}")
        return
    results = publish(study, out, last, console.say)
    if any(result.record()["verdict"] in console.VERDICT_STYLE for result in results):
        console.console.print(console.claims_table(results))
    console.say(f"report: {out}")


class InterruptedStudyError(Exception):
    """A study that did not come to its end."""

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message)
        self.code = code
