"""Values from the parameters or the JSON body of a request. Errors name the parameter."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

# The parameters of a request, by name.
Query = Mapping[str, str]
# Larger numbers are rejected before they are parsed.
MAX_DIGITS: Final = 11


def read_text(query: Query, name: str) -> str:
    """Return a parameter. Raise ValueError if it is missing."""
    if name not in query:
        raise ValueError(f"{name} is missing from the request")
    return query[name]


def read_number(query: Query, name: str, default: int | None = None) -> int:
    """Return a parameter as a whole number of at least 0."""
    if default is not None and name not in query:
        return default
    value = read_text(query, name)
    is_whole_number = value.isascii() and value.isdecimal() and len(value) <= MAX_DIGITS
    if not is_whole_number:
        raise ValueError(f"{name} = {value!r} must be a whole number of at least 0")
    return int(value)


def read_real(query: Query, name: str, default: float) -> float:
    """Return a parameter as a finite number. Raise ValueError for another value."""
    text = query.get(name, str(default))
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ValueError(f"{name} = {text!r} must be a finite number")
    return value


def read_body_number(body: Mapping[str, Any], name: str, default: int) -> int:
    """Return a whole number from a JSON body. Raise ValueError for another value."""
    value = body.get(name, default)
    if isinstance(value, bool) or not isinstance(value, int):
        raise ValueError(f"{name} = {value!r} must be a whole number")
    return value
