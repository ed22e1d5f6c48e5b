"""Instructions that add runs to a study, for the notes on too few runs."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from baldwinlab.core.files import quote_path
from baldwinlab.experiment.conditions import CONDITIONS, SWEEP
from baldwinlab.studies.store import StudyStore

SWEEP_INSTRUCTION: Final = (
    "To add runs, set runs = {runs} in the file of the sweep, and repeat the command."
)
MULTIVERSE_INSTRUCTION: Final = "To add runs, repeat the command with --runs {runs}."


def format_instruction(directory: Path) -> str:
    """Return the command that adds runs to a study of conditions. "{runs}" is their number."""
    return f"To add runs: baldwinlab run {quote_path(directory)} --runs {{runs}}"


def instruction_of(study: StudyStore) -> str:
    """Return the instruction that adds runs to a stored study, with "{runs}" for their number."""
    if study.kind == CONDITIONS:
        return format_instruction(study.directory)
    return SWEEP_INSTRUCTION if study.kind == SWEEP else MULTIVERSE_INSTRUCTION
