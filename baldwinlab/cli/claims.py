"""Claims about a study."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from baldwinlab.api.claims import claims as decide
from baldwinlab.cli.options import Directory, Force, Last, Parts, load_parts
from baldwinlab.core import console
from baldwinlab.core.files import write_atomically
from baldwinlab.core.output_paths import require_writable
from baldwinlab.studies.store import StudyStore


def claims(
    directory: Directory,
    /,
    *,
    claims: Annotated[
        Path | None,
        Parameter(help="a TOML file of claims; those of the study's paper unless given"),
    ] = None,
    paper: Annotated[str, Parameter(help="a paper whose claims are decided")] = "",
    part: Parts = None,
    last: Last = 10,
    out: Annotated[
        Path | None, Parameter(help="a JSON file for the verdicts, for other programs")
    ] = None,
    force: Force = False,
) -> None:
    """Decide claims about a study: those of its paper, of another paper, or in a file (see docs/papers.md)."""
    load_parts(part)
    if out:
        require_writable("--out", out, b'"p_holm"', force=force)
    found = decide(StudyStore(directory), claims, paper=paper, last=last)
    if out:
        records = json.dumps(
            [result.record() for result in found], indent=2, ensure_ascii=False, allow_nan=False
        )
        write_atomically(out, f"{records}\n".encode())
        console.info(f"verdicts: {out}")
