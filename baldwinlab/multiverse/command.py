"""Every reading of the paper."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from baldwinlab.api.bring import bring
from baldwinlab.api.report import report
from baldwinlab.cli.common import BackendName, Executor, Last, Out, Parts, Runs, Seed, Workers, load_parts
from baldwinlab.errors import require_positive
from baldwinlab.factors import MULTIVERSE
from baldwinlab.multiverse.design import combinations, experiments, factors, one_at_a_time

ENOUGH_RUNS = 8  # 8 against 8 can reach an exact p of 0.00016, and 0.003 when Holm corrects 19 tests; 6 against 6 only 0.041


def multiverse(
    *,
    part: Parts = None,
    runs: Runs = ENOUGH_RUNS,
    full: Annotated[bool, Parameter(help="all 2048 combinations of the choices, not one at a time", negative="")] = False,
    executor: Executor = "threads",
    out: Out = None,
    workers: Workers = None,
    seed: Seed = 0,
    backend: BackendName = "auto",
    last: Last = 10,
) -> None:
    """Hold the paper's claims against every reading of the paper: each choice it leaves open, made otherwise.

    With 8 runs of each condition, a difference that every pair of runs shows stays significant when all tests of a reading are
    corrected together (p = 0.003); with fewer than 6, none can be.
    """
    load_parts(part)
    require_positive("last", last)
    readings = combinations() if full else one_at_a_time()
    out = out or Path("results/paper") / ("multiverse-full" if full else "multiverse")
    how: dict[str, Any] = {"workers": workers, "backend": backend, "executor": executor}
    study = bring(experiments(readings), out, runs=runs, seed=seed, kind=MULTIVERSE, factors=factors(readings), **how)
    report(study, last=last)
