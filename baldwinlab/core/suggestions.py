"""What an error says of a name that is not known: the nearest name, and all names or the nearest ones."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from typing import Final

LISTED: Final = 20  # names that are listed at most; of more names, the nearest ones are
NEAREST: Final = 5


def suggest(name: str, known: Iterable[str]) -> str:
    """Return the end of a sentence about an unknown name: ` (did you mean 'x'?); there are x, y`."""
    names = list(known)
    return f"{did_you_mean(name, names)}; {list_names(name, names)}"


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return ` (did you mean 'x'?)` for a known name that is close to this one, else nothing."""
    near = get_close_matches(name, list(known), n=1)
    return f" (did you mean {near[0]!r}?)" if near else ""


def list_names(name: str, known: Iterable[str]) -> str:
    """Return `there are x, y`, or, of more than `LISTED` names, the five that are nearest to this one."""
    names = list(dict.fromkeys(known))
    if len(names) <= LISTED:
        return f"there are {', '.join(names)}" if names else "there are none"
    nearest = get_close_matches(name, names, n=NEAREST, cutoff=0)
    return f"the nearest of {len(names)} names are {', '.join(nearest)}"
