"""A paper, whole."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from baldwinlab.api.gallery import ALL, reproduce_all
from baldwinlab.api.reproduce import lengths, reproduce_changed
from baldwinlab.api.run_study import How
from baldwinlab.cli.options import (
    Assignments,
    BackendName,
    Executor,
    Force,
    Last,
    Out,
    Parts,
    PerhapsWhole,
    Seed,
    Variant,
    Workers,
    load_parts,
)
from baldwinlab.core.errors import RefusedError
from baldwinlab.papers import DEFAULT, load
from baldwinlab.papers.paper import STANDARD


def reproduce(
    paper: Annotated[
        str, Parameter(help="a paper, see `baldwinlab papers`, the folder of your own, or all")
    ] = DEFAULT,
    /,
    *,
    part: Parts = None,
    runs: Annotated[
        PerhapsWhole, Parameter(help="runs of each condition; the paper's own number unless given")
    ] = None,
    generations: Annotated[
        PerhapsWhole, Parameter(help="generations of each run; the paper's own unless given")
    ] = None,
    steps: Annotated[
        PerhapsWhole, Parameter(help="steps of a forager's life; the paper's own unless given")
    ] = None,
    seed: Seed = 0,
    variant: Variant = STANDARD,
    assignments: Assignments = None,
    workers: Workers = None,
    out: Out = None,
    last: Last = 10,
    backend: BackendName = "auto",
    executor: Executor = "threads",
    force: Force = False,
) -> None:
    """Reproduce a whole paper: its conditions, statistics, assays, figures and report; or all, and a page across them.

    With --set, --generations or --steps the study is one of a changed model, and all its results say so.
    """
    load_parts(part)
    if paper == ALL:
        _require_one_paper(assignments, variant)
        lives: dict[str, Any] = {
            "runs": runs,
            "generations": generations,
            "steps": steps,
            "seed": seed,
            "last": last,
        }
        how: dict[str, Any] = {
            "workers": workers,
            "backend": backend,
            "executor": executor,
            "force": force,
        }
        reproduce_all(out or Path("results"), **lives, **how)
        return
    chosen = load(paper)
    reproduce_changed(
        chosen,
        [*lengths(chosen, generations, steps), *(assignments or [])],
        How(workers, backend, executor, force),
        runs=runs,
        seed=seed,
        variant=variant,
        out=out,
        last=last,
    )


def _require_one_paper(assignments: list[str] | None, variant: str) -> None:
    """Raise RefusedError for options that belong to one paper."""
    if assignments:
        raise RefusedError(
            f"--set {' '.join(assignments)} is of one paper; give its name instead of {ALL}"
        )
    if variant != STANDARD:
        raise RefusedError(
            f"--variant {variant} is of one paper; all of them are reproduced by their standard variant"
        )
