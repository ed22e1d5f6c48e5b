"""Functions that read the parameters and the JSON body of a request. Errors name the parameter."""

from __future__ import annotations

import json
import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from http import HTTPStatus
from typing import Any, Final

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.types import ASGIApp, Receive, Scope, Send

from baldwinlab.core.files import parse_json

# The parameters of a request, by name.
Query = Mapping[str, str]
# The parameters of a lifetime, see `life_query.find_life`.
LIFE: Final = ("study", "condition", "run", "generation", "live", "preset", "seed")
# The parameters that each route reads. A route that is not listed reads none.
PARAMETERS: Final[Mapping[str, Sequence[str]]] = {
    "/api/agent": (*LIFE, "agent", "first", "last"),
    "/api/alleles": ("study", "condition", "run", "live", "generation"),
    "/api/ancestors": (*LIFE, "agent"),
    "/api/behavior": (*LIFE, "of"),
    "/api/experiment": ("study", "condition"),
    "/api/frames": (
        *LIFE,
        *("first", "count", "interval"),
        *("left", "top", "right", "bottom", "columns", "rows", "max_shapes"),
    ),
    "/api/laboratory": ("a", "b", "step"),
    "/api/lineage": (*LIFE, "agent"),
    "/api/movie": ("a", "b", "step", "format", "ticket"),
    "/api/movie/progress": ("ticket",),
    "/api/papers": ("paper",),
    "/api/papers/picture": ("paper",),
    "/api/preset": ("name",),
    "/api/recording": (*LIFE, "first", "last"),
    "/api/results": ("study",),
    "/api/results/figure": ("study", "figure", "format", "condition"),
    "/api/results/reaction": ("study",),
    "/api/results/runs": ("study", "condition", "measure"),
    "/api/run": ("study", "condition", "run"),
    "/api/share": ("a", "b", "step"),
    "/api/typical": ("study", "condition"),
    "/api/view": ("study", "condition", "run", "generation", "view", "agent"),
}
# An experiment has some thousand bytes.
MAX_BODY_BYTES: Final = 2**20
# Larger numbers are rejected before they are parsed.
MAX_DIGITS: Final = 11


def read_text(query: Query, name: str) -> str:
    """Return a parameter. Raise ValueError if it is missing."""
    if name not in query:
        raise ValueError(f"{name} is missing from the request")
    return query[name]


def read_number(query: Query, name: str, default: int | None = None) -> int:
    """Return a parameter as a whole number of at least 0.

    Raise ValueError for another value, and for a missing parameter without a default.
    """
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


async def read_body(request: Request, *names: str) -> dict[str, Any]:
    """Return the JSON body of a request, whose fields have these names.

    Raise ValueError if it is not a JSON object, is nested too deeply or has another field, and
    HTTPException if it is too large.
    """
    raw = bytearray()
    async for chunk in request.stream():
        raw += chunk
        if len(raw) > MAX_BODY_BYTES:
            raise HTTPException(
                HTTPStatus.REQUEST_ENTITY_TOO_LARGE,
                f"the body may have at most {MAX_BODY_BYTES:,} bytes",
            )
    try:
        body = parse_json(bytes(raw))
    except (json.JSONDecodeError, UnicodeDecodeError):
        body = None
    if not isinstance(body, dict):
        raise ValueError(f"{request.url.path} needs a JSON object")
    require_known_names(request.url.path, "field", body, names)
    return body


def require_known_names(
    path: str, kind: str, names: Iterable[str], known_names: Collection[str]
) -> None:
    """Raise ValueError for a field or a parameter that a route does not read."""
    for name in names:
        if name not in known_names:
            raise ValueError(
                f"{path} has no {kind} {name!r}; it reads {', '.join(known_names) or 'none'}"
            )


class KnownParameters:
    """An application that refuses a request with a parameter that its route does not read."""

    def __init__(self, app: ASGIApp, path: str) -> None:
        self.app = app
        self.names = PARAMETERS.get(path, ())

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Check the parameters of a request, and pass it to the route."""
        request = Request(scope)
        require_known_names(request.url.path, "parameter", request.query_params, self.names)
        await self.app(scope, receive, send)
