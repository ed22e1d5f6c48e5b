"""Names that users give: allowed forms, names that systems refuse, and similar valid names."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import PurePath
from typing import Final

CONDITION_NAME: Final = r"^[A-Za-z0-9][A-Za-z0-9+_.-]*(/[A-Za-z0-9][A-Za-z0-9+_.-]*)*$"
SPECIES_NAME: Final = r"^[A-Za-z0-9][A-Za-z0-9+_.-]*$"
PAPER_NAME: Final = r"^[A-Za-z0-9][A-Za-z0-9_.-]*$"
GRID_NAME: Final = "^[a-z]+$"
MAP_NAME: Final = "^[a-z-]+$"
ATLAS_CLAIM: Final = r"^X\d+$"
PREDICTION: Final = r"^P\d+$"
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
    PREDICTION: "must be P and a number, such as P1",
    SHA256: "must be 64 hexadecimal digits, or empty",
}


def describe_pattern(pattern: str, description: str = "") -> str:
    """Return the rule of a pattern in words.

    `description`: description of the setting, for a pattern that is not in this module.
    """
    unknown_rule = "has another form than this setting allows"
    return _RULES.get(pattern, f"{unknown_rule}: {description}" if description else unknown_rule)


def read_stem(path: PurePath) -> str:
    """Return the name of a file without its suffix, in the same form (NFC) on every system."""
    # On macOS, many names have a letter and its accent as two characters.
    return unicodedata.normalize("NFC", path.stem)


# Windows reserves these names for devices, with and without an extension.
DEVICE_NAMES: Final = frozenset(
    {"con", "prn", "aux", "nul"}
    | {f"{port}{number}" for port in ("com", "lpt") for number in range(10)}
)


# pandas and R read these texts in a table as missing values.
MISSING_VALUES: Final = frozenset({"NA", "N/A", "n/a", "NaN", "nan", "NULL", "null", "None"})


def find_name_fault(name: str) -> str:
    """Return why a name cannot be a file on every system and a text in every table; "" if it can.

    >>> find_name_fault("evo/con"), find_name_fault("evo/A")
    ("Windows reserves 'con' for a device", '')
    """
    for folder in name.split("/"):
        if {folder, name} & MISSING_VALUES:
            return f"tables are read with {name!r} as a missing value"
        if folder.partition(".")[0].casefold() in DEVICE_NAMES:
            return f"Windows reserves {folder!r} for a device"
        if folder.endswith((".", " ")):
            return f"Windows removes the dot or space at the end of {folder!r}"
    return ""


def find_case_collision(names: Iterable[str]) -> tuple[str, str] | None:
    """Return two names that differ only in case, which macOS and Windows ignore, or None.

    >>> find_case_collision(["evo/A", "evo/B", "Evo/A"])
    ('evo/A', 'Evo/A')
    """
    name_by_folded: dict[str, str] = {}
    for name in names:
        first_name = name_by_folded.setdefault(name.casefold(), name)
        if first_name != name:
            return first_name, name
    return None


# Maximum number of valid names that an error lists completely.
MAX_LISTED: Final = 20
# Number of similar names that an error lists otherwise.
MAX_SIMILAR: Final = 5


def suggest(name: str, valid_names: Iterable[str]) -> str:
    """Return the end of an error message: ` (did you mean 'x'?); there are x, y`.

    >>> suggest("tournamnt", ["tournament", "rank"])
    " (did you mean 'tournament'?); there are tournament, rank"
    """
    names = list(valid_names)
    return f"{did_you_mean(name, names)}; {list_names(name, names)}"


def did_you_mean(name: str, valid_names: Iterable[str]) -> str:
    """Return ` (did you mean 'x'?)` for the most similar valid name, or ""."""
    similar = get_close_matches(name, list(valid_names), n=1)
    return f" (did you mean {similar[0]!r}?)" if similar else ""


def list_names(name: str, valid_names: Iterable[str]) -> str:
    """Return `there are x, y`, or only similar names if there are more than `MAX_LISTED`."""
    names = list(dict.fromkeys(valid_names))
    if len(names) <= MAX_LISTED:
        return f"there are {', '.join(names)}" if names else "there are none"
    similar = get_close_matches(name, names, n=MAX_SIMILAR, cutoff=0)
    return f"the most similar of {len(names)} names are {', '.join(similar)}"
