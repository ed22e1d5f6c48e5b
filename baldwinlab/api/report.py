"""The results of a study on the page and in the terminal."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from baldwinlab.analysis.claims import describe_claims_too_few
from baldwinlab.analysis.multiverse.section import combinations, verdict
from baldwinlab.api.publish import lab_results
from baldwinlab.api.publish.multiverse import publish as publish_multiverse
from baldwinlab.api.publish.study import Published, need, publish
from baldwinlab.api.tables import VERDICT_STYLE, claims_table, show_contrasts, variants_table
from baldwinlab.core import console
from baldwinlab.core.errors import RefusedError, require_positive
from baldwinlab.core.files import is_local, require_place
from baldwinlab.core.output_paths import REPORT, require_writable
from baldwinlab.core.resources import require
from baldwinlab.experiment.factors import CONDITIONS, MULTIVERSE
from baldwinlab.papers import Paper
from baldwinlab.studies.claims_file import CLAIMS
from baldwinlab.studies.store import StudyStore


def report(
    study: StudyStore,
    out: Path | None = None,
    *,
    last: int = 10,
    force: bool = False,
    add_results: Callable[[], None] | None = None,
    baseline: str = "",
    paper: Paper | None = None,
) -> Path:
    """Write statistics, figures and the page of a study, a sweep or a multiverse, and show its results.

    Parameters
    ----------
    out
        The HTML file; report.html in the study's directory unless given.
    last
        The number of generations over which a run is averaged, counted from its last one.
    force
        Write even if it takes more memory than is free, or over a file that is no report.
    add_results
        It is called when the page is written; then the page is written again, with the files that it has added to the study.
    baseline
        The condition with which all others are compared; see `statistics.contrasts.references` for the default.
    paper
        The paper whose claims are decided; the one that made the study unless given.

    Returns
    -------
    Path
        The path of the page.

    Raises
    ------
    StudyError
        No run is stored, or none of `baseline`, or the study has no such condition.
    RefusedError
        `out` is a file of a study, or no report; it takes more memory than is free; or the study is of a kind that has no
        baseline or no claims.
    """
    require_positive("last", last)
    lab_results.require_baseline(study, baseline)
    if baseline and study.kind == MULTIVERSE:
        raise RefusedError(
            f"--baseline {baseline}: {study.directory} is a multiverse, whose report compares no conditions"
        )
    if paper and study.kind != CONDITIONS:
        raise RefusedError(
            f"--paper {paper.name}: {study.directory} is a {study.kind}, whose report decides no claims by it"
        )
    if out is None:
        out = study.directory / "report.html"
    elif is_local(out):
        require_writable("--out", out, REPORT.encode(), force=force)
    for path in (study.directory / CLAIMS, study.directory / "figures" / "fitness.svg"):
        require_place(path)  # each for all files of its folder
    require(f"the report of {study.directory}", need(study), force=force)
    if study.kind == MULTIVERSE:
        multiverse = publish_multiverse(study, out, last, console.progress, console.info)
        lab_results.keep(study)
        console.console.print(variants_table(multiverse))
        for sentence in (*verdict(multiverse.singles), *combinations(multiverse)):
            console.info(f"- {sentence}")
    else:
        published = publish(study, out, last, console.info, baseline, paper)
        _show(study, published, out)
        if add_results:
            add_results()
            published.write()
            _show(study, published, out)
        return out
    console.info(f"report: {out}")
    return out


def _show(study: StudyStore, published: Published, out: Path) -> None:
    """Show the comparisons of the conditions, and the claims that were decided; of a study by a paper the claims alone."""
    decided = any(claim.verdict in VERDICT_STYLE for claim in published.claims)
    if not (study.paper and decided):
        show_contrasts(published.contrasts)
    if decided:
        console.console.print(claims_table(published.claims, changed_model=study.changed_model))
        console.info_if_any(describe_claims_too_few(published.claims))
    console.info(f"report: {out}")
