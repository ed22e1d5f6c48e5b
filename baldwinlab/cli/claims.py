"""The command `claims`: evaluate claims about a study."""

from __future__ import annotations

from json import dumps
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from baldwinlab.api.claims import evaluate_claims
from baldwinlab.cli.options import (
    FLAG,
    HIDE_DEFAULT,
    OVERWRITE_FORCE,
    Directory,
    Json,
    LastGenerations,
    Parts,
    load_parts,
)
from baldwinlab.core import console
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.core.output_paths import require_writable
from baldwinlab.studies.store import StudyStore


def claims(
    directory: Directory,
    /,
    *,
    claims: Annotated[
        Path | None, Parameter(help="TOML file with claims. Default: the claims of --paper.")
    ] = None,
    paper: Annotated[
        str,
        HIDE_DEFAULT,
        Parameter(help="Paper whose claims are evaluated. Default: the paper of the study."),
    ] = "",
    part: Parts = None,
    last_generations: LastGenerations = 10,
    out: Annotated[
        Path | None, Parameter(help="JSON file for the verdicts. Default: no file.")
    ] = None,
    force: Annotated[bool, FLAG, Parameter(help=OVERWRITE_FORCE)] = False,
    json: Json = False,
) -> None:
    """Evaluate claims about a study, from its paper, another paper, or a file.

    The verdicts are printed. Nothing is written unless --out is given.

    For example:

        baldwinlab claims results/paper --claims my-claims.toml
    """
    load_parts(part)
    if out:
        # Every file of this command contains this key.
        require_writable("--out", out, b'"p_holm"', force=force)
    if json:
        console.reserve_stdout()
    results = evaluate_claims(StudyStore(directory), claims, paper=paper, last=last_generations)
    records = [result.record() for result in results]
    if json:
        console.print_json(records)
    if out:
        text = dumps(records, indent=2, ensure_ascii=False, allow_nan=False)
        write_atomically(out, f"{text}\n".encode())
        console.info(f"verdicts: {out}")
