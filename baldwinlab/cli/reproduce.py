"""A paper, whole."""

from __future__ import annotations

from typing import Annotated

from cyclopts import Parameter

from baldwinlab.api import reproduce as papers
from baldwinlab.cli.common import BackendName, Executor, Force, Last, Out, Parts, PerhapsWhole, Reading, Seed, Workers, load_parts
from baldwinlab.papers import DEFAULT


def reproduce(
    paper: Annotated[str, Parameter(help="a paper, see `baldwinlab papers`, or the folder of your own")] = DEFAULT,
    /,
    *,
    part: Parts = None,
    runs: Annotated[PerhapsWhole, Parameter(help="runs of each condition; the paper's own number unless given")] = None,
    generations: Annotated[PerhapsWhole, Parameter(help="generations of each run; the paper's own unless given")] = None,
    steps: Annotated[PerhapsWhole, Parameter(help="steps of a life; the paper's own unless given")] = None,
    seed: Seed = 0,
    reading: Reading = "standard",
    workers: Workers = None,
    out: Out = None,
    last: Last = 10,
    backend: BackendName = "auto",
    executor: Executor = "threads",
    force: Force = False,
) -> None:
    """Reproduce a whole paper: its conditions, statistics, assays, figures and report."""
    load_parts(part)
    papers.reproduce(
        paper,
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
        force=force,
    )
