"""The command `check`: test custom parts."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from baldwinlab.api.checks import REQUIREMENTS, iterate_findings
from baldwinlab.api.checks.fixture import SEED
from baldwinlab.cli.options import Json
from baldwinlab.core import console


def check(
    file: Annotated[Path, Parameter(help="Python file with one or more parts.")],
    /,
    *,
    requirements: Annotated[
        list[str] | None,
        Parameter(
            help=f"Test only these requirements: {', '.join(REQUIREMENTS)}. Default: all.",
            consume_multiple=True,
        ),
    ] = None,
    seed: Annotated[
        int, Parameter(help="Seed of the random worlds in which the parts are tested.")
    ] = SEED,
    json: Json = False,
) -> None:
    """Check whether the parts in a file fulfill the requirements for parts.

    Each requirement prints one line. A requirement that fails prints the command that repeats it.
    The hooks of a part first run in plain Python, in other processes. They must stay within their
    arrays, write their outputs, and read nothing that was never written. Then they are compiled.
    Their results must be bit-identical for one lane and for a SIMD block, in any batch, under both
    updates, in resumed and replayed runs, in plain Python and in the GPU simulator. They must agree
    with their oracle. Hooks without an oracle are listed as not verified. The exit status is 1 if a
    requirement fails.

    For example:

        baldwinlab check my_rule.py
    """
    findings = []
    console.reserve_stdout(json)
    for finding in iterate_findings(file, requirements or (), seed):
        console.info(str(finding))
        findings.append(finding)
    if json:
        console.print_json([finding._asdict() for finding in findings])
    if any(finding.holds is False for finding in findings):
        raise SystemExit(1)
