"""Which studies there are, and what they hold, as the page asks for it."""

from __future__ import annotations

from starlette.routing import BaseRoute

from baldwinlab.lab import Lab


def routes(lab: Lab) -> list[BaseRoute]:
    return []
