"""The command `assay`: measure the stored genomes of a study under changed conditions."""

from __future__ import annotations

from typing import Annotated

from cyclopts import Parameter

from baldwinlab.api.report import report
from baldwinlab.api.run_assays import run_missing_assays
from baldwinlab.api.run_options import RunOptions
from baldwinlab.cli.options import Directory, Executor, Force, Parts, Workers, load_parts
from baldwinlab.studies.assays.catalog import ASSAYS
from baldwinlab.studies.store import StudyStore


def assay(
    directory: Directory,
    /,
    *,
    assays: Annotated[
        str | None,
        Parameter(help=f"Assays, separated by commas: {', '.join(ASSAYS)}. Default: all."),
    ] = None,
    workers: Workers = None,
    part: Parts = None,
    executor: Executor = "threads",
    force: Force = False,
) -> None:
    """Simulate the stored genomes of a study under changed conditions, and measure what they do.

    For example, `innate` switches learning off. The results are written to assays/ in the directory
    of the study, and its report is written again. Stored assays are not repeated.

    For example:

        baldwinlab assay results/evo-A-evo+self-taught-A --assays innate,neutral
    """
    load_parts(part)
    study = StudyStore(directory)
    names = list(ASSAYS) if assays is None else [name.strip() for name in assays.split(",")]
    run_missing_assays(study, names, RunOptions(workers, executor=executor, force=force))
    report(study, force=force)
