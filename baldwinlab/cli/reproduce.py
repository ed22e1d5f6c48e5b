"""The paper, whole."""

from __future__ import annotations

from typing import Annotated

from cyclopts import Parameter

from baldwinlab.api import reproduce as papers
from baldwinlab.cli.common import BackendName, Executor, Last, Out, Runs, Seed, Workers


def reproduce(
    *,
    runs: Runs = 30,
    generations: Annotated[int | None, Parameter(help="generations of each run; 100 unless given")] = None,
    steps: Annotated[int | None, Parameter(help="steps of a life; 5000 unless given")] = None,
    seed: Seed = 0,
    reading: Annotated[str, Parameter(help="a named reading of the paper; see `baldwinlab presets`")] = "standard",
    workers: Workers = None,
    out: Out = None,
    last: Last = 10,
    backend: BackendName = "auto",
    executor: Executor = "threads",
) -> None:
    """Reproduce the whole paper: six conditions, statistics, assays, figures and report."""
    papers.reproduce(
        runs=runs,
        generations=generations,
        steps=steps,
        seed=seed,
        reading=reading,
        out=out,
        last=last,
        workers=workers,
        backend=backend,
        executor=executor,
    )
