"""What this machine has and lacks."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from baldwinlab.api.doctor import examine, is_well
from baldwinlab.core import console

MARKS = {"well": "ok", "missing": "-", "problem": "PROBLEM"}


def doctor(
    folder: Annotated[Path, Parameter(help="where studies would be written")] = Path("results"),
    /,
) -> None:
    """Say what is installed, which extras, cores, memory, cache and GPU there are, and how to mend what is wrong.

    Ends with 1 where there is a problem. That something is missing which may be missing is none.
    """
    findings = []
    for finding in examine(folder):
        findings.append(finding)
        console.info(
            f"{MARKS[finding.state]:<8} {finding.about:<16} {finding.said}{f'; {finding.mend}' if finding.mend else ''}"
        )
    if not is_well(findings):
        console.warn("there are problems, see above")
        sys.exit(1)
