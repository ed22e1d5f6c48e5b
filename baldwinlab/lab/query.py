"""What a request asks for, in words that say what is wrong with it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from starlette.requests import Request

Query = Mapping[str, str]


def text(query: Query, name: str) -> str:
    """Raises ValueError where it is missing."""
    if name not in query:
        raise ValueError(f"{name} is missing from the request")
    return query[name]


def number(query: Query, name: str, default: int | None = None) -> int:
    """A whole number, at least 0. Raises ValueError for anything else, and where it is missing and has no default."""
    if default is not None and name not in query:
        return default
    given = text(query, name)
    if not (given.isascii() and given.isdecimal() and len(given) < 12):
        raise ValueError(f"{name} = {given!r} must be a whole number of at least 0")
    return int(given)


async def body(request: Request) -> dict[str, Any]:
    """What is posted. Raises ValueError where it is no JSON object."""
    try:
        found = json.loads(await request.body())
    except ValueError:
        found = None
    if not isinstance(found, dict):
        raise ValueError(f"{request.url.path} takes a JSON object")
    return found
