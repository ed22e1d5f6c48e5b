"""Every variant of a paper."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from baldwinlab.api.publish.multiverse import FOLDERS
from baldwinlab.api.report import report
from baldwinlab.api.run_study import How, bring
from baldwinlab.cli.options import (
    BackendName,
    Executor,
    Force,
    Last,
    Out,
    Parts,
    Runs,
    Seed,
    Workers,
    load_parts,
)
from baldwinlab.core import console
from baldwinlab.core.errors import require_positive
from baldwinlab.core.output_paths import is_study
from baldwinlab.experiment.factors import MULTIVERSE
from baldwinlab.papers import DEFAULT, PaperError, load
from baldwinlab.studies.multiverse import combinations, experiments, factors, one_at_a_time
from baldwinlab.studies.store import StudyStore

ENOUGH_RUNS = 8  # 8 against 8 can reach an exact p of 0.00016, and 0.003 when Holm corrects 19 tests; 6 against 6 only 0.041


def multiverse(
    paper: Annotated[
        str, Parameter(help="a paper, see `baldwinlab papers`, or the folder of your own")
    ] = DEFAULT,
    /,
    *,
    part: Parts = None,
    runs: Runs = ENOUGH_RUNS,
    full: Annotated[
        bool,
        Parameter(
            help="all combinations of the choices (of Le's paper 2048), not one at a time",
            negative="",
        ),
    ] = False,
    executor: Executor = "threads",
    out: Out = None,
    workers: Workers = None,
    seed: Seed = 0,
    backend: BackendName = "auto",
    last: Last = 10,
    force: Force = False,
) -> None:
    """Hold a paper's claims against every variant of the paper: each choice it leaves open, made otherwise.

    With 8 runs of each condition, a difference that every pair of runs shows stays significant when all tests of a variant are
    corrected together (p = 0.003); with fewer than 6, none can be. Where the folder lies in a study of the paper, as it does
    unless --out is given, the report of that study is written again.
    """
    load_parts(part)
    require_positive("last", last)
    chosen = None if paper == DEFAULT else load(paper)
    variants = combinations(chosen) if full else one_at_a_time(chosen)
    if chosen and not (chosen.claims and len(variants) > 1):
        raise PaperError(
            f"{chosen.folder}: a multiverse needs claims.toml, and a variant beside the standard in variants/"
        )
    out = out or Path("results") / (chosen.name if chosen else "paper") / (
        "multiverse-full" if full else "multiverse"
    )
    how = How(workers, backend, executor, force)
    study = bring(
        experiments(variants),
        out,
        how,
        runs=runs,
        seed=seed,
        paper=chosen,
        kind=MULTIVERSE,
        factors=factors(variants),
    )
    report(study, last=last, force=force)
    if out.name in FOLDERS and is_study(out.parent):
        console.info(
            f"{out.parent} is a study of the paper: its report is written again, with the variants"
        )
        report(StudyStore(out.parent), last=last, force=force)
