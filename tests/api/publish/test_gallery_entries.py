"""Claims of an entry of the gallery, by kind and verdict."""

from __future__ import annotations

from baldwinlab import papers
from baldwinlab.api.publish.gallery import _tabulate_claims
from baldwinlab.api.publish.gallery_entries import Entry


def test_verdicts_on_exploratory_claims_are_not_counted() -> None:
    paper = papers.load("morgan-2020")
    claims = {claim.id: "holds" for claim in paper.claims} | {"E6": "undecided"}
    entry = Entry(paper, (), paper.folder, 20, claims, (), "", ())
    ((_, rows),) = _tabulate_claims([entry]).groups
    assert rows[0] == ["claims of the paper", 3, 0, 0, ""]
    kind, *counts, others = rows[-1]
    assert (kind, counts) == ("exploratory claims", ["–"] * 3)
    assert others.startswith("E6 In a chain") and "undecided" in others
