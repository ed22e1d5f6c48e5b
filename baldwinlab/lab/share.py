"""What is on the screen, as a file that plays anywhere."""

from __future__ import annotations

from starlette.routing import BaseRoute

from baldwinlab.lab import Lab


def routes(lab: Lab) -> list[BaseRoute]:
    return []
