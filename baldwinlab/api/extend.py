"""Extend a stored study by more generations or more runs."""

from __future__ import annotations

from baldwinlab.api.run_options import RunOptions
from baldwinlab.api.run_study import StudyRequest, require_request, run_missing
from baldwinlab.core import console
from baldwinlab.core.numbers import check_numbers
from baldwinlab.studies.extension import extend_experiments, extend_study
from baldwinlab.studies.store import StudyStore


@check_numbers
def extend(
    study: StudyStore,
    options: RunOptions,
    *,
    generations: int | None = None,
    runs: int | None = None,
) -> StudyStore:
    """Run a stored study further, with more generations, more runs, or both.

    The stored generations do not change. The result is bit-identical to that of one long run.

    `generations`: by default the stored number. `runs`: number of runs of each condition. By
    default the largest stored number. Raises `StudyError` if the study has more generations, or is
    a sweep or a multiverse.
    """
    if runs is None:
        study.require_runs()
        # A condition without runs does not count.
        last_run = max(max(study.runs(name), default=0) for name in study.experiments)
        runs = last_run + 1 - study.first_run
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
