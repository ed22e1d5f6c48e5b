"""Claims that were registered before their runs, as text, table and JSON record."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from markupsafe import Markup

from baldwinlab.analysis.atlas.claims import AtlasClaimResult
from baldwinlab.analysis.report.content import count_verdicts
from baldwinlab.analysis.report.tables import Table, add_detail, badge


def record_claim(result: AtlasClaimResult) -> dict[str, Any]:
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


def tabulate_claims(label: str, results: Sequence[AtlasClaimResult]) -> Table:
    """Return the table of claims with their verdicts. `label`: name for screen readers."""
    rows = []
    for claim, evaluation in results:
        name = Markup("<strong>{}.</strong> {}").format(claim.id, claim.claim)
        heading = add_detail(name, f"{claim.complete_rule} {claim.remarks}")
        cells = [badge(evaluation.verdict), evaluation.numbers, evaluation.runs]
        rows.append((heading, [cells]))
    columns = {"Claim": "", "Verdict": "plain", "Numbers": "", "Runs": "plain"}
    return Table(label, columns, rows, "claims")
