"""Appearance of the world of a trace, and symbols of agents in movies and figures.

A trace is the record of every step of a lifetime. Each species has a shape and a color. Agents of
a population with one species are darts.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

from PIL import ImageColor, ImageDraw

from baldwinlab.analysis.palette import MOVIE_COLORS, choose_species_style, resolve_color
from baldwinlab.core.deferred import xr

APPEARANCE_ATTRIBUTE = "appearance"
# Angles of the corners of a dart, relative to the heading, in radians.
DART_ANGLES: Final = (0, 2.5, -2.5)
# Corners (x, y) of the shapes, in radii. y points down. The areas are about equal.
CORNERS: Final[Mapping[str, tuple[tuple[float, float], ...]]] = {
    "triangle": ((0, -1.45), (1.3, 0.9), (-1.3, 0.9)),
    "square": ((-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)),
    "diamond": ((0, -1.3), (1.3, 0), (0, 1.3), (-1.3, 0)),
}
# Radius of a shape, and length of the pointer, as multiples of the length of a dart. The pointer is
# the line from the center of a shape in the direction of the heading.
SHAPE_RADIUS: Final = 0.7
POINTER_LENGTH: Final = 1.5
# Width of the pointer, as a multiple of the width of an outline.
POINTER_WIDTH: Final = 2
# Fraction of the color of a species in the color of a trail. The rest is the background.
TRAIL_SHARE: Final = 0.4
# A position that is farther from the preceding one, in map units, begins another trail: the agent
# crosses the edge of the map, or a newborn replaces it.
MAX_STEP_LENGTH: Final = 10


def has_appearance(trace: xr.Dataset) -> bool:
    """Return whether a dataset describes the appearance of a world."""
    return APPEARANCE_ATTRIBUTE in trace.attrs


def read_appearance(trace: xr.Dataset) -> dict[str, Any]:
    """Return the stored appearance of the world of a trace: a result of `Appearance.to_dict`."""
    return dict(json.loads(trace.attrs[APPEARANCE_ATTRIBUTE]))


class AgentSymbol(NamedTuple):
    """Symbol of the agents of a species. Colors are "#rrggbb"."""

    name: str  # Name of the species, "" for a population with one species.
    shape: str  # "dart", "circle", or a key of `CORNERS`.
    fill: str  # Color of the inside of an agent that has eaten.
    outline: str
    trail: str


DART: Final = AgentSymbol(
    name="",
    shape="dart",
    fill=MOVIE_COLORS["agent"],
    outline=MOVIE_COLORS["outline"],
    trail=MOVIE_COLORS["trail"],
)


def list_symbols(trace: xr.Dataset) -> list[AgentSymbol]:
    """Return the symbol of each species of a trace. Without species, all agents are darts."""
    if "species" not in trace:
        return [DART]
    names = trace.attrs["species_names"].split(", ")
    return [_make_symbol(index, name) for index, name in enumerate(names)]


def _make_symbol(index: int, name: str) -> AgentSymbol:
    color_name, shape = choose_species_style(index)
    color = resolve_color(color_name)
    trail = "#{:02x}{:02x}{:02x}".format(*blend(color, TRAIL_SHARE))
    return AgentSymbol(name, shape, color, color, trail)


def list_symbol_numbers(trace: xr.Dataset) -> list[int]:
    """Return for each agent the index of the symbol in `list_symbols`, [agent]."""
    if "species" not in trace:
        return [0] * trace.sizes["agent"]
    return list(trace["species"].values.tolist())


def blend(color: str, share: float) -> tuple[int, ...]:
    """Return red, green and blue, 0 to 255, of a fraction `share` of a color on the background."""
    background = ImageColor.getrgb(MOVIE_COLORS["background"])
    pairs = zip(background, ImageColor.getrgb(color), strict=True)
    return tuple(round(below + (above - below) * share) for below, above in pairs)


def draw_agent(
    draw: ImageDraw.ImageDraw,
    symbol: AgentSymbol,
    position: tuple[float, float],
    heading: float,
    length: float,
    fill: str,
    line_width: int,
) -> None:
    """Draw an agent.

    - `position`: x and y of the center, in pixels. y points down.
    - `heading`: direction in radians, clockwise from the right.
    - `length`: distance from the center to a corner of a dart, in pixels.
    - `line_width`: width of the outline, in pixels.
    """
    x, y = position
    if symbol.shape == "dart":
        angles = [heading + turn for turn in DART_ANGLES]
        corners = [(x + length * math.cos(angle), y + length * math.sin(angle)) for angle in angles]
        draw.polygon(corners, fill, symbol.outline, line_width)
        return
    end = (
        x + POINTER_LENGTH * length * math.cos(heading),
        y + POINTER_LENGTH * length * math.sin(heading),
    )
    draw.line((position, end), symbol.outline, POINTER_WIDTH * line_width)  # Below the shape.
    draw_shape(draw, symbol, position, SHAPE_RADIUS * length, fill, line_width)


def draw_shape(
    draw: ImageDraw.ImageDraw,
    symbol: AgentSymbol,
    position: tuple[float, float],
    radius: float,
    fill: str,
    line_width: int,
) -> None:
    """Draw the shape of a species without a pointer. `position` and `radius` are in pixels."""
    x, y = position
    if symbol.shape == "circle":
        box = (x - radius, y - radius, x + radius, y + radius)
        draw.ellipse(box, fill, symbol.outline, line_width)
    else:
        corners = [(x + dx * radius, y + dy * radius) for dx, dy in CORNERS[symbol.shape]]
        draw.polygon(corners, fill, symbol.outline, line_width)
