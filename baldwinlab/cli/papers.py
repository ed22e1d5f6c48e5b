"""Papers: which there are."""

from __future__ import annotations

from baldwinlab.core import console
from baldwinlab.papers import built_in

SHOWN = 6  # conditions of a paper


def papers() -> None:
    """List the papers that can be reproduced."""
    listed = built_in().values()
    indent = max(len(paper.name) for paper in listed)
    for paper in listed:
        counts = [f"conditions: {len(paper.own())}", f"claims: {len(paper.claims)}"]
        console.info(f"{paper.name:<{indent}} {paper.about.source}")
        console.info(f"{'':<{indent}} {paper.about.description}")
        console.info(f"{'':<{indent}} {', '.join([*counts, *filter(None, [paper.about.link])])}")
        console.info(f"{'':<{indent}} {paper.about.year}, {_some(paper.own())}")
        console.info(f"{'':<{indent}} run it: baldwinlab reproduce {paper.name}")
    console.info(
        "baldwinlab reproduce PAPER runs one; a folder of your own with a paper.toml is one, too"
    )


def _some(names: list[str]) -> str:
    """The first of them, and how many more there are."""
    more = len(names) - SHOWN
    return ", ".join(names[:SHOWN]) + (f" and {more} more" if more > 0 else "")
