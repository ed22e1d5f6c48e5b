"""Sweeps: one experiment at many points of the space of its fields."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from baldwinlab.api import sweep as sweeps
from baldwinlab.cli.options import (
    BackendName,
    Executor,
    Force,
    Last,
    Out,
    Parts,
    Workers,
    load_parts,
)
from baldwinlab.core.errors import require_positive


def sweep(
    file: Annotated[
        Path,
        Parameter(
            help="a TOML file that says which fields are swept, and how; see docs/reference/sweeps.md"
        ),
    ],
    /,
    *,
    part: Parts = None,
    workers: Workers = None,
    out: Out = None,
    last: Last = 10,
    backend: BackendName = "auto",
    executor: Executor = "threads",
    force: Force = False,
) -> None:
    """Run an experiment at many points: a grid, a list, or a random or Sobol sample of any of its fields."""
    load_parts(part)
    require_positive("last", last)
    study = sweeps.sweep(
        file, out=out, workers=workers, backend=backend, executor=executor, force=force
    )
    study.report(last=last, force=force)
