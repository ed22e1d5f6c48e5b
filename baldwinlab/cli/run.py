"""The command `run`: simulate experiments as one study."""

from __future__ import annotations

from typing import Annotated

from cyclopts import Parameter

from baldwinlab.api.publish import lab_results
from baldwinlab.api.run import run_loaded
from baldwinlab.api.run_options import RunOptions
from baldwinlab.api.tables import show_contrasts
from baldwinlab.cli.options import (
    LOCATION,
    Assignments,
    Backend,
    Baseline,
    Executor,
    Experiment,
    Force,
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
    experiment: Experiment,
    /,
    *experiments: Annotated[
        str, Parameter(help="More experiments. All are conditions of the same study.")
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
        Parameter(
            help=f"{LOCATION} Default: results/NAME, where NAME joins the names of the experiments."
        ),
    ] = None,
    backend: Backend = "auto",
    executor: Executor = "threads",
    force: Force = False,
) -> None:
    """Run one or several experiments as one study, and compare them.

    Stored runs are not repeated: the same command resumes an interrupted study.

    For example:

        baldwinlab run evo/A evo+self-taught/A --runs 8 --set evolution.generations=50
    """
    load_parts(part)
    loaded = [load_with_origin(name, variant) for name in (experiment, *experiments)]
    options = RunOptions(workers, backend, executor, force)
    study = run_loaded(
        loaded, assignments or [], options, runs=runs, seed=seed, out=out, baseline=baseline
    )
    show_contrasts(lab_results.compare_study(StudyStore(study.directory), baseline=baseline))
    console.info(f"For statistics, figures and a page: baldwinlab report {study.directory}")
