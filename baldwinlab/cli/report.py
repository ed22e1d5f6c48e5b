"""The command `report`: write the statistics, the figures and the page of a study."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from baldwinlab.api.report import report as write_report
from baldwinlab.cli.options import (
    FLAG,
    HIDE_DEFAULT,
    OVERWRITE_FORCE,
    RESOURCE_FORCE,
    Baseline,
    Directory,
    Json,
    LastGenerations,
    Parts,
    load_parts,
)
from baldwinlab.cli.results import print_results
from baldwinlab.core import console
from baldwinlab.core.numbers import require_whole_number
from baldwinlab.papers import load
from baldwinlab.studies.store import StudyStore


def report(
    directory: Directory,
    /,
    *,
    out: Annotated[
        Path | None, Parameter(help="HTML file. Default: report.html in the study's directory.")
    ] = None,
    last_generations: LastGenerations = 10,
    baseline: Baseline = "",
    paper: Annotated[
        str,
        HIDE_DEFAULT,
        Parameter(help="Paper whose claims are evaluated. Default: the paper of the study."),
    ] = "",
    part: Parts = None,
    force: Annotated[bool, FLAG, Parameter(help=f"{RESOURCE_FORCE} {OVERWRITE_FORCE}")] = False,
    json: Json = False,
) -> None:
    """Write the statistics, the figures and the report of a study from its stored results.

    The page is report.html, the tables are CSV files, and the figures are in figures/, all in the
    directory of the study. Reading results needs no custom parts. With --part, the report also
    draws a replayed life.

    For example:

        baldwinlab report results/evo-A-evo+self-taught-A
    """
    load_parts(part)
    require_whole_number("last", last_generations)
    paper_data = load(paper) if paper else None
    if json:
        console.reserve_stdout()
    study = StudyStore(directory)
    write_report(
        study,
        out,
        last=last_generations,
        baseline=baseline,
        paper=paper_data,
        force=force,
    )
    if json:
        print_results(study, last_generations, baseline)
