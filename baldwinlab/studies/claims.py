"""What the report of a study has found of a paper's claims, read back from its claims.json."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from baldwinlab.files import RESULTS_FILE, json_of, text_of
from baldwinlab.studies.records import StudyError


def claims_in(directory: Path) -> list[dict[str, Any]]:
    """The claims as `papers.verdicts.write` has written them into a study's directory, each with `id` and `verdict` as text.

    Empty where no report has been made yet. Raises StudyError for a file that is damaged, or is another.
    """
    path, again = directory / "claims.json", "`baldwinlab report` makes it again"
    if not path.exists():
        return []
    try:
        found = json_of(text_of(path, RESULTS_FILE))
    except (OSError, ValueError) as error:
        raise StudyError(f"{path} cannot be read: {error}; {again}") from None
    if not isinstance(found, list) or not all(map(_is_claim, found)):
        raise StudyError(f"{path} holds no list of claims; {again}")
    return found


def _is_claim(one: Any) -> bool:
    return isinstance(one, dict) and all(isinstance(one.get(name), str) for name in ("id", "verdict"))
