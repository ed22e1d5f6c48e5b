"""Files of a study with claims that were registered before its runs: page, table and article."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from markupsafe import Markup

from baldwinlab.analysis.atlas.claims import AtlasClaimResult
from baldwinlab.analysis.report.content import count_verdicts
from baldwinlab.analysis.report.sections import Section, render, write_page
from baldwinlab.analysis.report.tables import Table, add_detail, badge
from baldwinlab.analysis.results.numbers import to_csv
from baldwinlab.core import console
from baldwinlab.core.file_writing import write_atomically, write_json


def publish_results(
    page: Path,
    title: str,
    lead: str,
    rows: Sequence[Mapping[str, Any]],
    claims: Sequence[AtlasClaimResult],
    article: str,
    sections: Iterable[Section],
) -> None:
    """Write the table, the verdicts, the article and the page into the folder of the page.

    `rows`: rows of the table, with the same columns. `sections`: the figures are drawn when a
    section is taken.
    """
    folder = page.parent
    write_atomically(page.with_suffix(".csv"), to_csv(list(rows[0]), rows))
    if claims:
        write_json(folder / "claims.json", [_record_claim(result) for result in claims])
    article_file = write_atomically(folder / "article.md", article.encode())
    console.info("drawing the figures")
    write_page(title, lead, list(sections), page, folder / "figures")
    console.info(f"{page}", has_address=True)
    console.info(f"{article_file}")


def _record_claim(result: AtlasClaimResult) -> dict[str, Any]:
    """Return the result of a claim for a JSON file."""
    claim, evaluation = result
    return {
        "id": claim.id,
        "claim": claim.claim,
        "rule": claim.complete_rule,
        "remarks": claim.remarks,
        "registered_verdict": claim.registered_verdict,
        "near_theorem": claim.near_theorem,
        **evaluation._asdict(),
    }


def describe_claims(claims: Sequence[AtlasClaimResult]) -> str:
    """Return the number of claims by verdict, such as "Of 3 claims, 2 hold, 1 is undecided."."""
    verdicts = [evaluation.verdict for _, evaluation in claims]
    return f"Of {len(claims)} claims, {count_verdicts(verdicts)}." if claims else ""


def render_claims(label: str, results: Sequence[AtlasClaimResult], **files: str) -> str:
    """Return the table of claims with their verdicts, and the SHA-256 of their files.

    `label`: name for screen readers. `files`: other values of ``atlas/claims.html``.
    """
    rows = []
    for claim, evaluation in results:
        name = Markup("<strong>{}.</strong> {}").format(claim.id, claim.claim)
        heading = add_detail(name, f"{claim.complete_rule} {claim.remarks}")
        cells = [badge(evaluation.verdict), evaluation.numbers, evaluation.runs]
        rows.append((heading, [cells]))
    columns = {"Claim": "", "Verdict": "plain", "Numbers": "", "Runs": "plain"}
    return render("atlas/claims.html", claims=Table(label, columns, rows, "claims"), **files)
