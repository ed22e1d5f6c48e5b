"""Read the parameters and the JSON body of a request, with errors that name the parameter."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, Final

from starlette.exceptions import HTTPException
from starlette.requests import Request

from baldwinlab.core.files import parse_json

Query = Mapping[str, str]
MAX_BODY_SIZE: Final = 2**20  # bytes; an experiment has some thousands


def text(query: Query, name: str) -> str:
    """Return a parameter. Raise ValueError if it is missing."""
    if name not in query:
        raise ValueError(f"{name} is missing from the request")
    return query[name]


def number(query: Query, name: str, default: int | None = None) -> int:
    """Return a parameter as a whole number of at least 0.

    Raise ValueError for another value, and for a missing parameter without a default.
    """
    if default is not None and name not in query:
        return default
    value = text(query, name)
    if not (value.isascii() and value.isdecimal() and len(value) < 12):
        raise ValueError(f"{name} = {value!r} must be a whole number of at least 0")
    return int(value)


def whole_number(content: Mapping[str, Any], name: str, default: int) -> int:
    """Return a whole number from a JSON body. Raise ValueError for another value."""
    value = content.get(name, default)
    if isinstance(value, bool) or not isinstance(value, int):
        raise ValueError(f"{name} = {value!r} must be a whole number")
    return value


async def body(request: Request) -> dict[str, Any]:
    """Return the JSON body of a request.

    Raise ValueError if it is not a JSON object or is nested too deeply, and HTTPException if it is
    too large.
    """
    content = bytearray()
    async for chunk in request.stream():
        content += chunk
        if len(content) > MAX_BODY_SIZE:
            raise HTTPException(413, f"the body may have at most {MAX_BODY_SIZE:,} bytes")
    try:
        value = parse_json(bytes(content))
    except (json.JSONDecodeError, UnicodeDecodeError):
        value = None
    if not isinstance(value, dict):
        raise ValueError(f"{request.url.path} needs a JSON object")
    return value
