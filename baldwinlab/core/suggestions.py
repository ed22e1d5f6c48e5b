"""Suggestions of valid names, for errors about an unknown name."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from typing import Final

# Maximum number of valid names that an error lists completely.
MAX_LISTED: Final = 20
# Number of similar names that an error lists otherwise.
MAX_SIMILAR: Final = 5


def suggest(name: str, valid_names: Iterable[str]) -> str:
    """Return the end of an error message: ` (did you mean 'x'?); there are x, y`."""
    names = list(valid_names)
    return f"{did_you_mean(name, names)}; {list_names(name, names)}"


def did_you_mean(name: str, valid_names: Iterable[str]) -> str:
    """Return ` (did you mean 'x'?)` for the most similar valid name, or ""."""
    similar = get_close_matches(name, list(valid_names), n=1)
    return f" (did you mean {similar[0]!r}?)" if similar else ""


def list_names(name: str, valid_names: Iterable[str]) -> str:
    """Return `there are x, y`; for more than `MAX_LISTED` names, the most similar names."""
    names = list(dict.fromkeys(valid_names))
    if len(names) <= MAX_LISTED:
        return f"there are {', '.join(names)}" if names else "there are none"
    similar = get_close_matches(name, names, n=MAX_SIMILAR, cutoff=0)
    return f"the most similar of {len(names)} names are {', '.join(similar)}"
