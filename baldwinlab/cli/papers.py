"""Papers: which there are."""

from __future__ import annotations

from baldwinlab import console
from baldwinlab.papers import built_in


def papers() -> None:
    """List the papers that can be reproduced."""
    for paper in built_in().values():
        console.say(f"{paper.name:<12} {paper.about.source}")
        console.say(f"{'':<12} {paper.about.description}")
        console.say(f"{'':<12} conditions: {len(paper.own())}, claims: {len(paper.claims)}, {paper.about.link}")
    console.say("baldwinlab reproduce PAPER runs one; a folder of your own with a paper.toml is one, too")
