"""The forms of names in files, and each form in words, for messages."""

from __future__ import annotations

from typing import Final

CONDITION_NAME: Final = r"^[A-Za-z0-9][A-Za-z0-9+_.-]*(/[A-Za-z0-9][A-Za-z0-9+_.-]*)*$"
SPECIES_NAME: Final = r"^[A-Za-z0-9][A-Za-z0-9+_.-]*$"
PAPER_NAME: Final = r"^[A-Za-z0-9][A-Za-z0-9_.-]*$"
GRID_NAME: Final = "^[a-z]+$"
MAP_NAME: Final = "^[a-z-]+$"
ATLAS_CLAIM: Final = r"^X\d+$"
SHA256: Final = "^([0-9a-f]{64})?$"

_RULES: Final = {
    CONDITION_NAME: (
        "must be letters, digits, + _ . and -, with / between parts that begin with a letter or a "
        "digit"
    ),
    SPECIES_NAME: "must be letters, digits, + _ . and -, and begin with a letter or a digit",
    PAPER_NAME: "must be letters, digits, _ . and -, and begin with a letter or a digit",
    GRID_NAME: "must be letters from a to z",
    MAP_NAME: "must be letters from a to z, and -",
    ATLAS_CLAIM: "must be X and a number, such as X1",
    SHA256: "must be 64 hexadecimal digits, or empty",
}


def describe_pattern(pattern: str, description: str = "") -> str:
    """Return the rule of a pattern in words.

    `description`: the description of the setting, which explains a pattern that this module does
    not have.
    """
    unknown_rule = "has another form than this setting allows"
    return _RULES.get(pattern, f"{unknown_rule}: {description}" if description else unknown_rule)
