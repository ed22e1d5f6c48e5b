"""What came of a study, on the page and on the screen."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from baldwinlab import console, results
from baldwinlab.api.tables import VERDICT_STYLE, claims_table, readings_table
from baldwinlab.errors import require_positive
from baldwinlab.factors import MULTIVERSE
from baldwinlab.files import is_local
from baldwinlab.multiverse.publish import publish as publish_multiverse
from baldwinlab.multiverse.section import combinations, verdict
from baldwinlab.outputs import REPORT, require_writable
from baldwinlab.papers.verdicts import ClaimResult
from baldwinlab.publish import need, publish
from baldwinlab.resources import require
from baldwinlab.studies.store import Study


def report(
    study: Study, out: Path | None = None, *, last: int = 10, force: bool = False, then: Callable[[], None] | None = None
) -> Path:
    """Write statistics, figures and the page of a study, a sweep or a multiverse, and show its claims; gives the page's path.

    `out` is report.html in the study's directory unless given. A run counts with its average over its `last` generations.
    `then` is done when it is written, and the page of a study is written again, with what that has left in the study's folder.
    Raises StudyError where no run is stored yet, and RefusedError where `out` would be written over a file of a study, or,
    unless forced, over one that is no report or for more memory than is free.
    """
    require_positive("last", last)
    if out is None:
        out = study.directory / "report.html"
    elif is_local(out):
        require_writable("--out", out, REPORT.encode(), force=force)
    require(f"the report of {study.directory}", need(study), force=force)
    if study.kind == MULTIVERSE:
        multiverse = publish_multiverse(study, out, last, console.progress, console.say)
        results.keep(study)
        console.console.print(readings_table(multiverse))
        for sentence in (*verdict(multiverse.singles), *combinations(multiverse)):
            console.say(f"- {sentence}")
    else:
        published = publish(study, out, last, console.say)
        _show(published.claims, out)
        if then:
            then()
            published.write()
            _show(published.claims, out)
        return out
    console.say(f"report: {out}")
    return out


def _show(claims: Sequence[ClaimResult], out: Path) -> None:
    if any(claim.record()["verdict"] in VERDICT_STYLE for claim in claims):
        console.console.print(claims_table(claims))
    console.say(f"report: {out}")
