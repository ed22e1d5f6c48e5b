"""Names are checked that are no files on macOS or Windows."""

from __future__ import annotations

from baldwinlab.core.file_names import find_case_collision, find_name_fault

FAULTS = {
    "Windows reserves": ["con", "CON", "evo/aux", "nul.toml", "com1/A", "Lpt9", "prn"],
    "Windows removes the dot or space": ["x.", "x./A", "evo/A ", "x. "],
}
VALID_NAMES = ["evo/A", "console", "com", "com10", "a.con", "x.y", "evo/con-1"]


def test_a_name_that_windows_reserves_or_changes_has_a_fault() -> None:
    for fault, names in FAULTS.items():
        assert [name for name in names if fault not in find_name_fault(name)] == []
    assert [name for name in VALID_NAMES if find_name_fault(name) != ""] == []


def test_names_collide_if_only_capital_letters_differ() -> None:
    assert find_case_collision(["evo/A", "evo/B", "Evo/a"]) == ("evo/A", "Evo/a")
    assert find_case_collision(["evo/A", "evo/B", "evo/A"]) is None
