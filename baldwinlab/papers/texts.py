"""What a report says of a paper and of no other: `words.toml` in its folder. All of it may be left out."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Literal

from pydantic import Field

from baldwinlab.papers.loading import Declared, declared, read

Figure = Literal[
    "overview", "fitness", "final-fitness", "emergence", "networks", "senses", "maps", "shares", "clocks", "measures", "survival"
]  # fmt: skip
FIGURES: tuple[Figure, ...] = (
    "fitness",
    "final-fitness",
    "emergence",
    "networks",
    "senses",
    "maps",
)
Assay = Literal["innate", "neutral", "within-life", "modules", "reaction", "descent"]
Question = Literal[
    "gain", "learning", "newborns", "innate", "share", "need",
    "movement", "cost", "sooner", "guidance", "built-innate", "built-learned", "reinforcement", "action",
]  # fmt: skip


class Inference(Declared):
    """How the paper infers the Baldwin effect, beside the question of ours that makes the same comparison."""

    question: Question
    says: str
    limit: str = ""  # what that comparison cannot show


class Words(Declared):
    heading: str = ""  # of the report
    captions: Mapping[Figure, str] = Field(
        default_factory=dict
    )  # what a figure's caption adds on the paper's own figure
    inference: Inference | None = None


def read_words(path: Path) -> Words:
    """The words in a file; none where there is no such file. Raises PaperError."""
    return declared(Words, read(path), path) if path.exists() else Words()
