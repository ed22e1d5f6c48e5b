"""Texts of a paper for its report (`words.toml`) and its card in the lab (`card.toml`)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from baldwinlab.papers.loading import DeclaredTable, read_tables, validate_tables

# Names of figures in this package are not checked: the package `analysis` has the registry.
DEFAULT_FIGURES: tuple[str, ...] = (
    "fitness",
    "species",
    "final-fitness",
    "emergence",
    "networks",
    "senses",
    "maps",
)
Question = Literal[
    "gain", "learning", "newborns", "innate", "share", "need", "movement", "cost", "sooner",
    "guidance", "built-innate", "built-learned", "reinforcement", "action",
]  # fmt: skip


class Inference(DeclaredTable):
    """Statement of a paper on the Baldwin effect, and the question that makes its comparison."""

    question: Question
    # One sentence of the report.
    text: str = Field(alias="says")
    # Limit of the comparison.
    limit: str = ""


class ReportTexts(DeclaredTable):
    """Texts that a paper adds to its report."""

    # Heading of the report.
    heading: str = ""
    # The question that the study answers, as the first line of the report.
    question: str = ""
    # Additions to captions that compare a figure with one of the paper.
    captions: Mapping[str, str] = Field(default_factory=dict)
    inference: Inference | None = None


def read_texts(path: Path) -> ReportTexts:
    """Return the texts in a file; empty texts if it does not exist. Raises PaperError."""
    return validate_tables(ReportTexts, read_tables(path), path) if path.exists() else ReportTexts()


class Exercise(DeclaredTable):
    """A live run that shows one fact of the paper.

    Attributes
    ----------
    text : str
        What to do, and what to expect.
    preset : str
        The preset of the live run.
    changes : Mapping[str, Any]
        Changed settings by path.
    """

    text: str
    preset: str
    changes: Mapping[str, Any] = Field(default_factory=dict)


class PaperCard(DeclaredTable):
    """The texts of a card.

    Attributes
    ----------
    question : str
        The question of the paper in a few words.
    notice : str
        A result to notice.
    exercise : Exercise
        The table `try`.
    extend : str
        A question for a further study.
    """

    question: str
    notice: str
    exercise: Exercise = Field(alias="try")
    extend: str


def read_card(path: Path) -> PaperCard | None:
    """Return the texts in a file, or None if it does not exist. Raises PaperError."""
    return validate_tables(PaperCard, read_tables(path), path) if path.exists() else None
