"""Experiments of one's own."""

from __future__ import annotations

from typing import Annotated

from cyclopts import Parameter

from baldwinlab.api.publish import lab_results
from baldwinlab.api.run import run_loaded
from baldwinlab.api.run_study import How
from baldwinlab.api.tables import show_contrasts
from baldwinlab.cli.options import (
    LOCATION,
    Assignments,
    BackendName,
    Baseline,
    Executor,
    Force,
    NamedExperiment,
    Out,
    Parts,
    Runs,
    Seed,
    Variant,
    Workers,
    load_parts,
)
from baldwinlab.core import console
from baldwinlab.papers.presets import load_with_origin
from baldwinlab.studies.store import StudyStore


def run(
    experiment: NamedExperiment,
    /,
    *others: Annotated[
        str, Parameter(help="more experiments, which are compared in the same study")
    ],
    part: Parts = None,
    variant: Variant = "standard",
    assignments: Assignments = None,
    baseline: Baseline = "",
    runs: Runs = 30,
    seed: Seed = 0,
    workers: Workers = None,
    out: Annotated[
        Out,
        Parameter(help=f"{LOCATION}; results/NAME unless given, NAME is that of the experiments"),
    ] = None,
    backend: BackendName = "auto",
    executor: Executor = "threads",
    force: Force = False,
) -> None:
    """Run an experiment, a preset or a TOML file; or several in one study, and compare them."""
    load_parts(part)
    loaded = [load_with_origin(name, variant) for name in (experiment, *others)]
    how = How(workers, backend, executor, force)
    study = run_loaded(
        loaded, assignments or [], how, runs=runs, seed=seed, out=out, baseline=baseline
    )
    show_contrasts(lab_results.compare(StudyStore(study.directory), baseline=baseline))
    console.info(f"for statistics, figures and a report: baldwinlab report {study.directory}")
