"""The texts of a paper's card in the lab, read from its `card.toml`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import Field

from baldwinlab.papers.loading import DeclaredTable, read_tables, validate_tables


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
