"""Create, open or extend a study. Run the missing runs and assays with a progress bar."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from threading import Lock

from baldwinlab.api.run_options import AssayOptions, RunOptions, exclude_remote_memory
from baldwinlab.core import console
from baldwinlab.core.console import FitnessCurves
from baldwinlab.core.deferred import xr
from baldwinlab.core.errors import ArgumentError, InterruptedStudyError, RefusedError
from baldwinlab.core.file_writing import require_writable_path, write_atomically
from baldwinlab.core.numbers import SEED_LIMIT, check_numbers, format_count, require_whole_number
from baldwinlab.core.resources import NO_NEED, Need, require_resources
from baldwinlab.evolution import require_founders
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.conditions import CONDITIONS, Factors, StudyKind
from baldwinlab.experiment.miniworld import count_worlds
from baldwinlab.models.miniworld.backends.choice import (
    Backend,
    Workload,
    choose_backend,
    require_species_batch,
)
from baldwinlab.papers import Paper, save_copy
from baldwinlab.papers.worlds import find_factors
from baldwinlab.simulation import memory
from baldwinlab.studies.assays.catalog import estimate_assays, get_assays, not_applicable_reasons
from baldwinlab.studies.assays.results import assay_path, find_missing_assays
from baldwinlab.studies.assays.run import count_assay_steps, run_assays
from baldwinlab.studies.checkpoints import Interval
from baldwinlab.studies.creation import (
    create_study,
    extend_experiments,
    extend_study,
    remove_if_refused,
)
from baldwinlab.studies.executors import (
    THREADS,
    Executor,
    ExecutorError,
    can_share_threads,
    describe_workers,
)
from baldwinlab.studies.open import format_sample_sentence, sample_runs
from baldwinlab.studies.run import count_agent_steps, find_missing_runs, run_study
from baldwinlab.studies.run_task import Callback
from baldwinlab.studies.status import (
    count_requested_runs,
    count_stored_runs,
    require_complete_runs,
)
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.study_length import hold_length


@dataclass(frozen=True)
class StudyRequest:
    """The conditions of a study to create or to complete, with the number of runs of each."""

    experiments: Sequence[Experiment]  # One experiment per condition.
    directory: Path
    runs: int  # Number of runs of each condition, at least 1.
    seed: int  # Seed of the study, 0 to 2**31 - 1.
    # The paper that defines the study. A custom paper is copied into the directory.
    paper: Paper | None = None
    changes: Sequence[str] = ()  # Assignments that change the model of the paper.
    kind: StudyKind = CONDITIONS
    # Factors of each condition, by name. By default the factors of the paper, or of the presets.
    factors: Mapping[str, Factors] | None = None
    # Contents of further files of the directory, by file name.
    extra_files: Mapping[str, bytes] = field(default_factory=dict)
    # Memory and disk that the caller needs after the runs. The resource check includes them.
    later_need: Need = NO_NEED
    first_run: int = 0  # Index of the first run of each condition.

    @property
    def total_runs(self) -> int:
        """Return the number of runs of all conditions."""
        return self.runs * len(self.experiments)


@dataclass(frozen=True)
class ExecutionPlan:
    """The executor, the backend, the number of parallel tasks, and the checkpoint interval."""

    executor: Executor
    backend: Backend
    parallel_tasks: int
    checkpoint_interval: Interval


def run_missing(
    request: StudyRequest, options: RunOptions, callback: Callback | None = None
) -> StudyStore:
    """Create or open a study and run its missing runs.

    Nothing remains of a new study if the request is refused before a generation was simulated.

    `callback`: called after each generation of a run with the dataset of the run, one call at a
    time.
    """
    if callback and options.executor != THREADS.name:
        raise RefusedError(
            "a callback runs on this machine only: leave it out, or use 'threads', "
            f"not {options.executor!r}"
        )
    execution = require_request(request, options)
    with remove_if_refused(request.directory):
        study = _open_or_create(request)
        with hold_length(study):
            _simulate_missing(study, request, execution, callback)
        return study


def _simulate_missing(
    study: StudyStore,
    request: StudyRequest,
    execution: ExecutionPlan,
    callback: Callback | None,
) -> None:
    """Find and simulate the missing runs of a study."""
    missing = find_missing_runs(study, request.runs, console.warn)
    if not any(missing.values()):
        study.remove_abandoned_files()
        runs = format_count(request.total_runs, "run")
        console.info(f"{study.location}: {runs} stored, none to do")
        return
    _announce_runs(study, missing, request)
    # On threads, there is at least one task for each worker if there are as many runs.
    n_missing = sum(map(len, missing.values()))
    console.info_once(describe_workers(execution.executor, execution.parallel_tasks, n_missing))
    curves = FitnessCurves()
    # Only threads of this process report the fitness for the curves. Other executors do not.
    is_observed = console.console.is_terminal and execution.executor.name == THREADS.name
    with report_progress_on_error(
        request.directory, lambda: _describe_stored_runs(study, request.runs)
    ):
        run_study(
            study,
            missing,
            execution.parallel_tasks,
            partial(console.progress, outcome=curves),
            console.info,
            backend=execution.backend,
            executor=execution.executor,
            checkpoint_interval=execution.checkpoint_interval,
            callback=partial(_call_alone, Lock(), callback) if callback else None,
            observe=curves.add if is_observed else None,
        )


def _call_alone(lock: Lock, callback: Callback, dataset: xr.Dataset) -> None:
    """Call a function while no other thread calls it."""
    with lock:
        callback(dataset)


def require_request(request: StudyRequest, options: RunOptions) -> ExecutionPlan:
    """Check a request and the free resources, and return its plan. Nothing is written.

    Raise ArgumentError for a number that is out of range.
    """
    require_whole_number("runs", request.runs, SEED_LIMIT - request.first_run)
    require_whole_number("seed", request.seed)
    executor = options.make_executor()
    backend = _choose_backend(options.backend, executor, request)
    parallel_tasks = executor.workers
    if backend.tasks:
        # While the GPU simulates some tasks, the CPU creates the next generations of the others.
        parallel_tasks = max(parallel_tasks, len(request.experiments), backend.tasks)
    for experiment in request.experiments:
        require_founders(experiment, request.first_run + request.runs)
    interval = Interval.parse(options.checkpoint)
    execution = ExecutionPlan(executor, backend, parallel_tasks, interval)
    _require_resources(request, execution, options.force)
    return execution


def _choose_backend(name: str, executor: Executor, request: StudyRequest) -> Backend:
    """Return the backend. "auto" is the CPU for remote workers, species, and other models.

    Remote workers may lack a GPU. Only the model MiniWorld without species runs on a GPU.
    """
    is_miniworld = all(isinstance(experiment, Experiment) for experiment in request.experiments)
    is_local = executor.name == THREADS.name
    has_species = any(experiment.population.species for experiment in request.experiments)
    can_use_gpu = is_miniworld and is_local and not has_species
    if name == "auto" and not can_use_gpu:
        name = "cpu"
    if not is_miniworld:
        return choose_backend(name)
    workload = Workload(
        worlds=request.total_runs * min(map(count_worlds, request.experiments)),
        agents=max(experiment.agents_per_world for experiment in request.experiments),
        steps=min(
            experiment.evolution.generations * experiment.lifetime.steps
            for experiment in request.experiments
        ),
        cores=executor.workers,
    )
    backend = choose_backend(name, workload)
    if has_species:
        require_species_batch(backend)
    return backend


def _require_resources(request: StudyRequest, execution: ExecutionPlan, force: bool) -> None:
    """Raise RefusedError if too little memory or disk is free for the runs or the later work."""
    missing = [
        (experiment, count_missing_runs(request, experiment)) for experiment in request.experiments
    ]
    need = memory.estimate_runs(
        missing,
        execution.parallel_tasks,
        execution.backend.worlds,
        has_shared_threads=can_share_threads(execution.executor, execution.backend),
    )
    need = exclude_remote_memory(need, execution.executor).add_later(request.later_need)
    runs = format_count(request.total_runs, "run")
    require_resources(runs, need, request.directory, force=force)
    for experiment in request.experiments:
        memory.require_storable_record(experiment)


def count_missing_runs(request: StudyRequest, experiment: Experiment) -> int:
    """Return the number of requested runs of a condition that are not stored completely."""
    runs = range(request.first_run, request.first_run + request.runs)
    counts = count_stored_runs(request.directory, experiment, request.seed, runs)
    return request.runs - counts.complete


def _open_or_create(request: StudyRequest) -> StudyStore:
    """Return the study in the directory. Create the study if it does not exist."""
    factors = request.factors
    if factors is None:
        factors = request.paper.factors() if request.paper else find_factors(request.experiments)
    study = create_study(
        request.directory,
        request.experiments,
        request.seed,
        request.kind,
        factors=factors,
        paper=request.paper.name if request.paper else "",
        changes=request.changes,
        first_run=request.first_run,
    )
    if request.paper:
        save_copy(request.paper, request.directory)
    for name, content in request.extra_files.items():
        write_atomically(request.directory / name, content)
    return study


def _announce_runs(
    study: StudyStore, missing: Mapping[str, Sequence[int]], request: StudyRequest
) -> None:
    """Check that records can be written, and print the numbers of stored and missing runs."""
    study.require_writable(study.path(name, runs[0]) for name, runs in missing.items() if runs)
    n_missing = sum(map(len, missing.values()))
    n_stored = request.total_runs - n_missing
    agent_steps = sum(
        count_agent_steps(study.experiments[name]) * len(runs) for name, runs in missing.items()
    )
    may_stop = any(study.experiments[name].may_stop for name, runs in missing.items() if runs)
    # A run that stops needs fewer agent-steps.
    limit = "at most " if may_stop else ""
    console.info(
        f"{study.location}: {n_stored:,} of {request.total_runs:,} "
        f"runs stored, {n_missing:,} to do ({limit}{agent_steps:,} agent-steps)"
    )


def _describe_stored_runs(study: StudyStore, runs: int) -> str:
    """Return the number of stored runs as text."""
    requested_runs = range(study.first_run, study.first_run + runs)
    n_stored = sum(
        run in requested_runs for condition in study.experiments for run in study.runs(condition)
    )
    return f"{n_stored} of {runs * len(study.experiments)} runs are stored in {study.location}"


@check_numbers
def extend(
    study: StudyStore,
    options: RunOptions,
    *,
    generations: int | None = None,
    runs: int | None = None,
) -> StudyStore:
    """Run a stored study further, for `Study.extend`."""
    if runs is None:
        runs = count_requested_runs(study)
        if not runs:
            study.require_runs()
    experiments = study.experiments
    if generations is not None:
        experiments = extend_experiments(study, generations)
    request = StudyRequest(
        list(experiments.values()),
        study.directory,
        runs=runs,
        seed=study.seed,
        kind=study.kind,
        factors=study.factors,
        first_run=study.first_run,
    )
    # The study changes only if the request is not refused.
    require_request(request, options)
    if generations is not None:
        extend_study(study, generations)
        console.info(f"{study.location}: {generations} generations")
    return run_missing(request, options)


@contextmanager
def report_progress_on_error(directory: Path, describe_stored: Callable[[], str]) -> Iterator[None]:
    """Add the number of stored results to the message if the context is interrupted."""
    try:
        yield
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"Interrupted. {_resume_message(describe_stored())}") from None
    except ExecutorError as error:
        raise InterruptedStudyError(f"{error}. {_resume_message(describe_stored())}") from None
    except OSError as error:
        # An error without a file name is about the directory.
        file = error.filename or directory
        raise InterruptedStudyError(
            f"cannot write {file}: {error.strerror or error}. {_resume_message(describe_stored())}"
        ) from None


def _resume_message(stored: str) -> str:
    return f"{stored}. Repeat the command to continue."


class RemainingTime:
    """Estimate of the time left for all studies. `amounts`: missing work of each, in `unit`."""

    def __init__(self, amounts: Sequence[int], unit: str = "agent-steps") -> None:
        self._amounts = amounts
        self._unit = unit
        self._n_begun = 0
        self._start = time.monotonic()

    def announce(self, title: str) -> None:
        """Print the title of the next study, and the time left for this and all later studies."""
        done = sum(self._amounts[: self._n_begun])
        left = sum(self._amounts[self._n_begun :])
        self._n_begun += 1
        seconds = time.monotonic() - self._start
        note = f"{left:,} {self._unit} left in all studies"
        if done and left:
            note += f", about {max(1, round(seconds * left / done / 60))} min"
        console.info(f"{title}: study {self._n_begun} of {len(self._amounts)}; {note}")


def run_missing_assays(
    study: StudyStore, names: Sequence[str], options: AssayOptions, generations: int | None = None
) -> None:
    """Run the missing assays of a study on the CPU.

    `generations`: number of generations of the branches of a fork, at least 1. The default is 20.
    If the argument is None, a stored fork with another number is not run again. Raises StudyError
    for an unknown name.
    """
    require_branch_length(generations, names)
    executor = options.make_executor()
    study.require_parts()
    require_complete_runs(study)
    for sentence in not_applicable_reasons(study, names):
        console.info(sentence)
    missing = find_missing_assays(study, names, generations)
    n_assays = sum(map(len, missing.values()))
    if not n_assays:
        study.remove_abandoned_files()
        console.info(f"{study.location}: all assays are already stored")
        return
    for condition, assays in missing.items():
        for name in assays:
            require_writable_path(assay_path(study.directory, name, condition))
    run_counts = {condition: len(sample_runs(study, condition)) for condition in missing}
    total_need = estimate_assays(study, missing, run_counts, executor.workers)
    need = exclude_remote_memory(total_need, executor)
    require_resources(f"{n_assays} assays", need, study.directory, force=options.force)
    agent_steps = count_assay_steps(study, missing, generations)
    console.info(f"{study.location}: {n_assays} assays to do ({agent_steps:,} agent-steps)")
    console.info_if_any(format_sample_sentence(study))
    n_runs = sum(run_counts.values())
    console.info_once(describe_workers(executor, executor.workers, n_runs))

    def describe_stored_assays() -> str:
        """Return the number of stored assays as text."""
        n_missing = sum(map(len, find_missing_assays(study, names, generations).values()))
        return f"{n_assays - n_missing} of {n_assays} assays are stored in {study.location}"

    with (
        hold_length(study),
        report_progress_on_error(study.directory, describe_stored_assays),
    ):
        run_assays(
            study,
            missing,
            executor.workers,
            console.progress,
            console.info,
            executor=executor,
            generations=generations,
        )


@check_numbers
def require_branch_length(generations: int | None, names: Sequence[str]) -> None:
    """Raise ArgumentError if `generations` is given, and no named assay has branches."""
    has_branches = any(assay.with_branches for assay in get_assays(names))
    if generations is not None and not has_branches:
        raise ArgumentError("generations", generations, "needs the assay fork or fork-mode")
