"""The command `doctor`: examine this machine."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Final

from cyclopts import Parameter

from baldwinlab.api.doctor import examine, has_problem
from baldwinlab.cli.options import Json
from baldwinlab.core import console

STATE_MARKS: Final = {"well": "ok", "missing": "-", "problem": "PROBLEM"}


def doctor(
    folder: Annotated[
        Path, Parameter(help="Folder for studies. The command tests whether it can be written.")
    ] = Path("results"),
    /,
    *,
    json: Json = False,
) -> None:
    """List installed packages, extras, cores, memory, disk, cache and GPU, and how to fix problems.

    A line that begins with "-" names a missing optional feature. A line that begins with "PROBLEM"
    names a missing requirement of baldwinlab. The exit status is 1 if there is a problem.

    For example:

        baldwinlab doctor
    """
    findings = []
    console.reserve_stdout(json)
    for finding in examine(folder):
        findings.append(finding)
        fix = f"; {finding.fix}" if finding.fix else ""
        console.info(f"{STATE_MARKS[finding.state]:<8} {finding.topic:<16} {finding.message}{fix}")
    if json:
        console.print_json([finding._asdict() for finding in findings])
    if has_problem(findings):
        console.warn("this machine has problems, see the lines that begin with PROBLEM")
        sys.exit(1)
