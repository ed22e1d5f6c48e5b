"""Checking parts of one's own."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from baldwinlab import console
from baldwinlab.check import REQUIREMENTS, findings
from baldwinlab.check.subject import SEED
from baldwinlab.cli.common import Whole


def check(
    file: Annotated[Path, Parameter(help="a file with one or more parts")],
    /,
    *,
    only: Annotated[
        list[str] | None, Parameter(help=f"try some requirements alone: {', '.join(REQUIREMENTS)}", consume_multiple=True)
    ] = None,
    seed: Annotated[Whole, Parameter(help="of the random worlds in which it is tried; another seed tries others")] = SEED,
) -> None:
    """Check a part of your own: does it keep the contract? One line a requirement, and how to try it again where it fails.

    A part must have the same bits alone and in a bundle, in any batch, under both updates, resumed, replayed, in plain Python
    and on a GPU; agree with its own oracle, the same in plain Python; look at no other agent where it acts for one; calculate
    in float32 and without libm; and refuse what is beyond its limits. Its speed is told beside that of the built-in part of
    its kind.
    """
    failed = False
    for finding in findings(file, only or (), seed):
        console.say(str(finding))
        failed |= finding.holds is False
    if failed:
        raise SystemExit(1)
