"""What a request asks for, in words that say what is wrong with it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, Final

from starlette.exceptions import HTTPException
from starlette.requests import Request

from baldwinlab.core.files import json_of

Query = Mapping[str, str]
MOST_POSTED: Final = 2**20  # bytes; an experiment takes some thousands


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


def whole(order: Mapping[str, Any], name: str, default: int) -> int:
    """A whole number in what is posted. Raises ValueError for anything else."""
    value = order.get(name, default)
    if isinstance(value, bool) or not isinstance(value, int):
        raise ValueError(f"{name} = {value!r} must be a whole number")
    return value


async def body(request: Request) -> dict[str, Any]:
    """What is posted. Raises ValueError where it is no JSON object, or nests too deep; HTTPException where it is too large."""
    posted = bytearray()
    async for piece in request.stream():
        posted += piece
        if len(posted) > MOST_POSTED:
            raise HTTPException(413, f"at most {MOST_POSTED:,} bytes may be posted")
    try:
        found = json_of(bytes(posted))
    except (json.JSONDecodeError, UnicodeDecodeError):
        found = None
    if not isinstance(found, dict):
        raise ValueError(f"{request.url.path} takes a JSON object")
    return found
