"""Checking parts of one's own."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from baldwinlab.api.checks import REQUIREMENTS, findings
from baldwinlab.api.checks.fixture import SEED
from baldwinlab.cli.options import Whole
from baldwinlab.core import console


def check(
    file: Annotated[Path, Parameter(help="A file with one or more parts.")],
    /,
    *,
    only: Annotated[
        list[str] | None,
        Parameter(
            help=f"Try some requirements alone: {', '.join(REQUIREMENTS)}", consume_multiple=True
        ),
    ] = None,
    seed: Annotated[
        Whole, Parameter(help="Seed of the random worlds in which the parts are tried.")
    ] = SEED,
) -> None:
    """Check whether the parts of a file keep the contract of parts.

    Each requirement is a line; one that does not hold says how to try it again. First the hooks of a part
    run in plain Python, in other processes: they must stay within their arrays, write their outputs and
    read nothing that was never written. Then they are compiled: they must give the same bits alone and in
    a SIMD block, in any batch, under both updates, resumed, replayed, in plain Python and in the simulator
    of a GPU, and agree with their oracle. Hooks without an oracle are listed as not verified.
    """
    failed = False
    for finding in findings(file, only or (), seed):
        console.info(str(finding))
        failed |= finding.holds is False
    if failed:
        raise SystemExit(1)
