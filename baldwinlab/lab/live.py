"""Runs that live while somebody watches."""

from __future__ import annotations

from starlette.routing import BaseRoute

from baldwinlab.lab import Lab


class Live:
    """The runs that live now."""


def routes(lab: Lab) -> list[BaseRoute]:
    return []
