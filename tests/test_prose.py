"""Tests of the check for retired words."""

from __future__ import annotations

from pathlib import Path

import pytest

from scripts.prose import check_file

CASES = {
    "names.py": ("def found(who):\n    lived = runs = 1\n", {"found", "who", "lived"}),
    "text.py": ('"""Return the value.\n\nIt lies beside the map."""\n', {"lies", "beside"}),
    "comment.py": ("x = 1  # who eats\n", {"who"}),
    "string.py": ('print("nobody is here")\nkey = "who"\n', {"nobody"}),
    "page.md": ("The agent `who` stands.\n\n```\nwho\n```\n", {"stands"}),
    "start.md": (
        "What is eaten reappears. What is this?\n",
        {"What is eaten reappears.", "What is eaten"},
    ),
    "table.toml": ('beside = "the colour of an item"\n', {"colour"}),
    "page.html": ('<p class="who">{{ who }} nobody</p>', {"nobody"}),
    "page.js": ("const found = 1; // a twin\n", {"found", "twin"}),
}


@pytest.mark.parametrize("name", CASES)
def test_retired_words_are_found_in_names_and_prose_but_not_in_code(
    name: str, tmp_path: Path
) -> None:
    text, expected = CASES[name]
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    assert {word for _, word, _ in check_file(path)} == expected


def test_a_finding_has_the_line_and_the_replacement(tmp_path: Path) -> None:
    path = tmp_path / "page.md"
    path.write_text("First line.\n\nThe run is kept.\n", encoding="utf-8")
    assert list(check_file(path)) == [(3, "kept", "stored, cached, saved")]
