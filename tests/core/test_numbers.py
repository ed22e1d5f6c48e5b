"""Tests of numbers in text."""

from __future__ import annotations

import pytest

from baldwinlab.core.numbers import format_count


@pytest.mark.parametrize(
    ("number", "text"),
    [
        (0, "0 runs"),
        (1, "1 run"),
        (2, "2 runs"),
        (1_000_000, "1,000,000 runs"),
        ("1", "1 run"),
        ("8 to 20", "8 to 20 runs"),
    ],
)
def test_a_noun_is_singular_for_exactly_one(number: int | str, text: str) -> None:
    assert format_count(number, "run") == text
