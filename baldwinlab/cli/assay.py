"""Assays of a stored study."""

from __future__ import annotations

from typing import Annotated

from cyclopts import Parameter

from baldwinlab.api import run_study
from baldwinlab.api.report import report
from baldwinlab.cli.options import Directory, Executor, Force, Parts, Workers, load_parts
from baldwinlab.studies.assays.run import ASSAYS
from baldwinlab.studies.store import StudyStore


def assay(
    directory: Directory,
    /,
    *,
    only: Annotated[
        str | None,
        Parameter(help=f"some of {', '.join(ASSAYS)}, with commas between; all unless given"),
    ] = None,
    workers: Workers = None,
    part: Parts = None,
    executor: Executor = "threads",
    force: Force = False,
) -> None:
    """Live the genomes of a stored study again under changed circumstances, measure them, and rebuild the report."""
    load_parts(part)
    study = StudyStore(directory)
    names = list(ASSAYS) if only is None else [name.strip() for name in only.split(",")]
    run_study.assay(study, names, run_study.How(workers, executor=executor, force=force))
    report(study, force=force)
