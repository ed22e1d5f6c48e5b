"""Sweeps: one experiment at many points of the space of its fields."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from baldwinlab.cli.common import BackendName, Executor, Last, Out, Workers, app, bring, make_report, require_positive
from baldwinlab.factors import SWEEP
from baldwinlab.sweeps.design import create
from baldwinlab.sweeps.plan import read


@app.command
def sweep(
    file: Annotated[Path, Parameter(help="a TOML file that says which fields are swept, and how; see docs/sweeps.md")],
    /,
    *,
    workers: Workers = None,
    out: Out = None,
    last: Last = 10,
    backend: BackendName = "auto",
    executor: Executor = "threads",
) -> None:
    """Run an experiment at many points: a grid, a list, or a random or Sobol sample of any of its fields."""
    require_positive("--last", last)
    if workers is not None:
        require_positive("--workers", workers)
    plan = read(file)
    directory = out or Path("results") / file.stem
    points = create(directory, plan, file)
    study = bring(points, plan.runs, plan.seed, workers, directory, backend, executor, SWEEP)
    make_report(study, directory / "report.html", last)
