"""Describe an unknown name in an error: the most similar name, and all names or the similar ones."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from typing import Final

MAX_LISTED: Final = 20  # names; of more names, only the most similar are listed
MAX_SIMILAR: Final = 5


def suggest(name: str, known: Iterable[str]) -> str:
    """Return the end of a sentence about an unknown name: ` (did you mean 'x'?); there are x, y`."""
    names = list(known)
    return f"{did_you_mean(name, names)}; {list_names(name, names)}"


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return ` (did you mean 'x'?)` for the most similar known name, or ""."""
    similar = get_close_matches(name, list(known), n=1)
    return f" (did you mean {similar[0]!r}?)" if similar else ""


def list_names(name: str, known: Iterable[str]) -> str:
    """Return `there are x, y`. Of more than `MAX_LISTED` names, list the most similar ones."""
    names = list(dict.fromkeys(known))
    if len(names) <= MAX_LISTED:
        return f"there are {', '.join(names)}" if names else "there are none"
    similar = get_close_matches(name, names, n=MAX_SIMILAR, cutoff=0)
    return f"the most similar of {len(names)} names are {', '.join(similar)}"
