"""Test the check for retired words."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from scripts.prose import check_file

# The cases are in a file that the check does not read.
CASES = json.loads(Path(__file__).with_name("prose_cases.json").read_text("utf-8"))


@pytest.mark.parametrize("name", CASES)
def test_retired_words_are_reported_in_names_and_prose_but_not_in_code(
    name: str, tmp_path: Path
) -> None:
    path = tmp_path / name
    path.write_text(CASES[name]["text"], encoding="utf-8")
    assert {word for _, word, _ in check_file(path)} == set(CASES[name]["retired"])


def test_a_finding_has_the_line_and_the_replacement(tmp_path: Path) -> None:
    path = tmp_path / "page.md"
    path.write_text(CASES["line.md"]["text"], encoding="utf-8")
    assert list(check_file(path)) == [(3, "kept", "stored, cached, saved")]
