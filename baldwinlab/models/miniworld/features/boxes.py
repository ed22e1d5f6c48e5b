"""Positions and rectangles on the map, as settings of world features."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Annotated, Any

from baldwinlab.parts import Field

Coordinate = Annotated[float, Field(ge=0, le=1_000_000)]
Derived = Mapping[str, Callable[[Any, Any], Any]]


def require_on_map(path: str, box: Iterable[float], world: Any) -> None:
    """Raise ValueError if a box is not on the map."""
    left, right, upper, lower = box
    if not (0 <= left < right <= world.width and 0 <= upper < lower <= world.height):
        listed = ", ".join(f"{edge:g}" for edge in (left, right, upper, lower))
        raise ValueError(
            f"{path} = [{listed}] must be left < right and upper < lower, on the map of "
            f"{world.width:g} x {world.height:g}"
        )
