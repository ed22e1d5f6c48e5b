"""The results of a study."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from baldwinlab.api.report import report as make_report
from baldwinlab.cli.options import Baseline, Directory, Force, Last, Parts, load_parts
from baldwinlab.core.errors import require_positive
from baldwinlab.papers import load
from baldwinlab.studies.store import StudyStore


def report(
    directory: Directory,
    /,
    *,
    out: Annotated[
        Path | None, Parameter(help="the HTML file; DIR/report.html unless given")
    ] = None,
    last: Last = 10,
    baseline: Baseline = "",
    paper: Annotated[
        str,
        Parameter(
            help="a paper whose claims are decided; the one that made the study unless given"
        ),
    ] = "",
    part: Parts = None,
    force: Force = False,
) -> None:
    """Rebuild statistics, figures and report from stored results.

    No part is needed; with those of the study, the picture of a life lived again is drawn, too.
    """
    load_parts(part)
    require_positive("last", last)
    claimed = load(paper) if paper else None
    make_report(
        StudyStore(directory), out, last=last, baseline=baseline, paper=claimed, force=force
    )
