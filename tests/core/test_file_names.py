"""Names are checked that are no files on macOS or Windows."""

from __future__ import annotations

import pytest

from baldwinlab.core.file_names import find_case_collision, find_name_fault


@pytest.mark.parametrize("name", ["con", "CON", "evo/aux", "nul.toml", "com1/A", "Lpt9", "prn"])
def test_a_name_that_windows_reserves_has_a_fault(name: str) -> None:
    assert "Windows reserves" in find_name_fault(name)


@pytest.mark.parametrize("name", ["x.", "x./A", "evo/A ", "x. "])
def test_a_dot_or_a_space_at_the_end_is_a_fault(name: str) -> None:
    assert "Windows removes the dot or space" in find_name_fault(name)


@pytest.mark.parametrize("name", ["evo/A", "console", "com", "com10", "a.con", "x.y", "evo/con-1"])
def test_other_names_have_no_fault(name: str) -> None:
    assert find_name_fault(name) == ""


def test_names_collide_if_only_capital_letters_differ() -> None:
    assert find_case_collision(["evo/A", "evo/B", "Evo/a"]) == ("evo/A", "Evo/a")
    assert find_case_collision(["evo/A", "evo/B", "evo/A"]) is None
