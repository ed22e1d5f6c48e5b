"""The command `report`: write the report of a study or of papers, or evaluate claims."""

from __future__ import annotations

from collections.abc import Mapping
from json import dumps
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from baldwinlab.api.publish.gallery import compare_papers
from baldwinlab.api.publish.gallery_entries import holds_studies
from baldwinlab.api.publish.unwritten_files import warn_of_unwritten_files
from baldwinlab.api.report import evaluate_claims
from baldwinlab.api.report import report as write_report
from baldwinlab.cli.options import (
    LOCATION,
    Baseline,
    Directory,
    Force,
    Json,
    LastGenerations,
    Parts,
    load_parts,
)
from baldwinlab.cli.results import print_gallery, print_results
from baldwinlab.core import console
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.core.files import require_writable
from baldwinlab.core.numbers import require_whole_number
from baldwinlab.papers import load
from baldwinlab.studies.store import StudyStore


def report(
    directory: Annotated[
        Directory, Parameter(help=f"{LOCATION} Or a folder of studies, whose papers are compared.")
    ],
    /,
    *,
    claims: Annotated[
        list[str] | None,
        Parameter(
            consume_multiple=(0, 1),
            help="Evaluate the claims of a TOML file or of a paper; without a value, those of the "
            "paper of the study. Default: write the report.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        Parameter(
            help="HTML file. Default: report.html in the study's directory, or gallery.html in a "
            "folder of studies. With --claims, JSON file for the verdicts. Default: no file."
        ),
    ] = None,
    last_generations: LastGenerations = 10,
    baseline: Baseline = "",
    paper: Annotated[
        str,
        Parameter(help="Paper whose claims are evaluated. Default: the paper of the study."),
    ] = "",
    part: Parts = None,
    force: Force = False,
    json: Json = False,
) -> None:
    """Write the statistics, the figures and the report of a study from its stored results.

    The page is report.html, the tables are CSV files, and the figures are in figures/, all in the
    directory of the study. Reading results needs no custom parts. With --part, the report also
    draws a replayed life. With --claims, the verdicts on the claims are printed, and nothing is
    written unless --out is given.

    If DIRECTORY is a folder of studies, its page compares their papers with one table and figure.
    It answers the same questions for every condition that evolves and learns.

    For example:

        baldwinlab report results/evo-A-evo+self-taught-A
        baldwinlab report results
        baldwinlab report results/paper --claims my-claims.toml
    """
    load_parts(part)
    console.reserve_stdout(json)
    require_whole_number("last", last_generations)
    if holds_studies(directory):
        options = {"--claims": claims is not None, "--baseline": baseline, "--paper": paper}
        _require_unused(options, f"{directory}, a folder of studies")
        with warn_of_unwritten_files(directory, out) as unwritten:
            page = compare_papers(directory, out, last=last_generations, force=force)
        if json:
            print_gallery(directory, page, unwritten)
        return
    study = StudyStore(directory)
    if claims is not None:
        _require_unused({"--baseline": baseline, "--paper": paper}, "--claims")
        source = claims[0] if claims else ""
        _report_claims(study, source, last_generations, out, force=force, json=json)
        return
    paper_data = load(paper) if paper else None
    with warn_of_unwritten_files(study.directory, out) as unwritten:
        write_report(
            study,
            out,
            last=last_generations,
            baseline=baseline,
            paper=paper_data,
            force=force,
        )
    if json:
        print_results(study, last_generations, baseline, unwritten)


def _require_unused(values: Mapping[str, object], context: str) -> None:
    """Raise RefusedError if an option has a value. `values`: {"--baseline": "evo/A", ...}."""
    for option, value in values.items():
        if value:
            raise RefusedError(f"{option} does not apply to {context}. Remove the option.")


def _report_claims(
    study: StudyStore, source: str, last: int, out: Path | None, *, force: bool, json: bool
) -> None:
    """Evaluate claims and print the verdicts. `source`: a file, a paper, or "" for the study's."""
    if out:
        # The command may overwrite a file with this key, because every file of verdicts has it.
        require_writable("--out", out, b'"p_holm"', force=force, suffixes=[".json"])
    records = [result.record() for result in evaluate_claims(study, source, last=last)]
    if json:
        console.print_json(records)
    if out:
        text = dumps(records, indent=2, ensure_ascii=False, allow_nan=False)
        write_atomically(out, f"{text}\n".encode())
        console.info(f"verdicts: {out}")
