"""Figures of maps and of agents' senses, to scale. y increases downward, as on a screen.

A map shows its edges, the birth disc, and the *appearance* that the parts declare. Traces store
the appearance as an attribute. If the parts are not installed, a map shows the regions of food.

Source: N. Le (2019), "The Simulated World of Foods and Agents".
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Ellipse, Rectangle, Wedge
from matplotlib.patheffects import withStroke

from baldwinlab.analysis.figures.style import BLACK, BLUE, FIGURE_WIDTH, GRAY, ORANGE, PALE, styled
from baldwinlab.analysis.palette import resolve_color
from baldwinlab.experiment import FoodRegion, World

# Side of an agent and of an item, in map units.
BODY_SIDE = 10.0
# Largest number of agents or items that an SVG contains as shapes. More are drawn as pixels.
MAX_VECTOR_SHAPES = 2000
# Largest number of maps in a row.
MAX_COLUMNS = 3
# Size of a map, in inches: the largest width, and the height in a full and in a shorter row.
MAX_MAP_WIDTH = 3.6
NARROW_MAP_HEIGHT = 2.5
WIDE_MAP_HEIGHT = 3.5
# Distance of a label from its region, in map units.
LABEL_DISTANCE = 8
# Angle of a sector, in degrees, up to which its edges have no label, for lack of space.
MIN_LABELED_DEGREES = 10
# Seed of the example positions.
EXAMPLE_SEED = 1906
# A white outline makes text readable on items.
TEXT_HALO = [withStroke(linewidth=2, foreground="white")]

Appearance = Mapping[str, Any]
"""`models.miniworld.appearance.Appearance` as plain data."""


@styled
def draw_world_maps(
    worlds: Mapping[str, World],
    agents: int,
    appearances: Mapping[str, Appearance] = MappingProxyType({}),
) -> Figure:
    """Draw maps with the birth disc, the regions of items, and an example of agents and items.

    `appearances`: appearances by title. A world without an appearance shows its food.
    """
    n_columns = min(len(worlds), MAX_COLUMNS)
    n_rows = math.ceil(len(worlds) / n_columns)
    width = min(FIGURE_WIDTH, MAX_MAP_WIDTH * n_columns)
    row_height = NARROW_MAP_HEIGHT if n_columns == MAX_COLUMNS else WIDE_MAP_HEIGHT
    figure = Figure((width, n_rows * row_height))
    grid = figure.subplots(n_rows, n_columns, squeeze=False)
    for axes, (title, world) in zip(grid.flat, worlds.items(), strict=False):
        _draw_map(axes, world, agents, appearances.get(title) or make_food_appearance(world))
        axes.set_title(title, loc="left", fontweight="bold")
    for axes in grid.flat[len(worlds) :]:
        axes.set_visible(False)
    return figure


def make_food_appearance(world: World) -> Appearance:
    """Return the appearance of a world without installed parts: the regions of food."""
    kinds = [{"name": "food", "color": "green", "number": region.count} for region in world.food]
    return {"marks": [_food_mark(region) for region in world.food], "item_kinds": kinds}


def _food_mark(region: FoodRegion) -> dict[str, Any]:
    left, right = region.x
    top, bottom = region.y
    return {
        "kind": "rectangle",
        "x": left,
        "y": top,
        "width": right - left,
        "height": bottom - top,
        "color": "green",
        "label": "food",
        "solid": False,
    }


def _draw_map(axes: Axes, world: World, agents: int, appearance: Appearance) -> None:
    generator = np.random.default_rng(EXAMPLE_SEED)
    draw_empty_map(axes, world, appearance)
    _draw_agents(axes, world, agents, generator)
    # Regions that overlap have one common label.
    labels: dict[tuple[float, float, float], list[str]] = {}
    for region, kind in zip(
        _select_item_regions(appearance), appearance["item_kinds"], strict=True
    ):
        left = region["x"]
        top = region["y"]
        right = left + region["width"]
        bottom = top + region["height"]
        n_items = kind["number"]
        x = generator.uniform(left, right, n_items)
        y = generator.uniform(top, bottom, n_items)
        _draw_squares(axes, x, y, resolve_color(kind["color"]))
        noun = f"of {kind['name']}"
        if kind["name"] == "food":
            noun = "item" if n_items == 1 else "items"
        labels.setdefault((left, right, top - LABEL_DISTANCE), []).append(f"{n_items} {noun}")
    for (left, right, height), texts in labels.items():
        center = (left + right) / 2
        # In the right half, a label ends at the edge of its region, so that it fits on the map.
        is_right = center > world.width / 2
        x = right if is_right else center
        alignment = "right" if is_right else "center"
        axes.annotate(
            ", ".join(texts),
            (x, height),
            ha=alignment,
            va="bottom",
            path_effects=TEXT_HALO,
        )


def _draw_agents(axes: Axes, world: World, agents: int, generator: np.random.Generator) -> None:
    """Draw example agents in the birth disc, with a line in the direction of their heading."""
    start = world.start
    axes.annotate(
        "born here,\nheading right",
        (start.x, start.y + start.radius + LABEL_DISTANCE),
        ha="center",
        va="top",
        path_effects=TEXT_HALO,
    )
    angle = generator.uniform(0, 2 * np.pi, agents)
    distance = start.radius * np.sqrt(generator.uniform(size=agents))
    x = start.x + distance * np.cos(angle)
    y = start.y + distance * np.sin(angle)
    _draw_squares(axes, x, y, BLUE)
    is_rasterized = agents > MAX_VECTOR_SHAPES
    axes.hlines(y, x, x + 1.2 * BODY_SIDE, color=BLACK, lw=0.9, rasterized=is_rasterized)


def _select_item_regions(appearance: Appearance) -> list[Mapping[str, Any]]:
    """Return the regions of items, in the order of `item_kinds`."""
    return [
        mark for mark in appearance["marks"] if mark["kind"] == "rectangle" and not mark["solid"]
    ]


def draw_empty_map(axes: Axes, world: World, appearance: Appearance) -> None:
    """Draw the edges of a map, the birth disc, the regions of items, and obstacles."""
    axes.set(xlim=(0, world.width), ylim=(world.height, 0), aspect="equal")
    quarters = np.linspace(0, 1, 5)
    axes.set_xticks(quarters * world.width)
    axes.set_yticks(quarters * world.height)
    axes.spines[:].set_visible(True)
    start = world.start
    disc = Circle((start.x, start.y), start.radius, fill=False, ec=BLUE, ls="--", lw=1)
    axes.add_patch(disc)
    for region in _select_item_regions(appearance):
        corner = (region["x"], region["y"])
        size = (region["width"], region["height"])
        color = resolve_color(region["color"])
        axes.add_patch(Rectangle(corner, *size, fc=color, alpha=0.15, lw=0))
        axes.add_patch(Rectangle(corner, *size, fill=False, ec=color, lw=1))
    for mark in appearance["marks"]:
        if mark["solid"]:
            _draw_obstacle(axes, mark)


def _draw_obstacle(axes: Axes, mark: Mapping[str, Any]) -> None:
    """Draw a solid mark with its label."""
    left = mark["x"]
    top = mark["y"]
    width = mark["width"]
    height = mark["height"]
    center = (left + width / 2, top + height / 2)
    is_disc = mark["kind"] == "disc"
    shape = Ellipse(center, width, height) if is_disc else Rectangle((left, top), width, height)
    shape.set(facecolor=resolve_color(mark["color"]), linewidth=0, zorder=2)
    axes.add_patch(shape)
    axes.annotate(mark["label"], (left + width + LABEL_DISTANCE, center[1]), ha="left", va="center")


def _draw_squares(axes: Axes, x: np.ndarray, y: np.ndarray, color: str) -> None:
    centers = np.stack([x, y], axis=-1)
    corners = BODY_SIDE / 2 * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    squares = PolyCollection(
        list(centers[:, None] + corners),
        facecolor=color,
        edgecolor="white",
        linewidth=0.3,
        rasterized=len(centers) > MAX_VECTOR_SHAPES,
    )
    axes.add_collection(squares)


class SensorSector(NamedTuple):
    """A sector in which an input senses items."""

    # Angles of the edges, in degrees clockwise from the heading.
    first_degrees: float
    last_degrees: float
    radius: float  # Radius, in map units.

    @property
    def middle_degrees(self) -> float:
        """The angle of the middle, in degrees clockwise from the heading."""
        return self.first_degrees + self.width_degrees / 2

    @property
    def width_degrees(self) -> float:
        """The angle between the edges, in degrees."""
        return (self.last_degrees - self.first_degrees) % 360


def group_sectors(appearance: Appearance) -> dict[SensorSector, list[str]]:
    """Return the names of the inputs of each sector."""
    input_names: dict[SensorSector, list[str]] = {}
    for name, edges in zip(appearance["inputs"], appearance["sectors"], strict=True):
        if edges:
            sector = SensorSector(edges["from_degrees"], edges["to_degrees"], edges["radius"])
            input_names.setdefault(sector, []).append(name)
    return input_names


@styled
def draw_agent_senses(appearance: Appearance) -> Figure:
    """Draw an agent that heads right, its sensor sectors, and an item in the last sector."""
    sectors = group_sectors(appearance)
    radius = max((sector.radius for sector in sectors), default=4 * BODY_SIDE)
    figure = Figure((3.6, 3.1))
    axes = figure.subplots()
    _draw_sectors(axes, sectors, radius)
    axes.add_patch(Circle((0, 0), radius, fill=False, ec=GRAY, ls="--", lw=1))
    text = f"sees to {radius:g} units" if sectors else "has no sensor sector"
    axes.text(0, -1.05 * radius, text, ha="center", va="bottom", color=GRAY)
    axes.annotate("", (0.45 * radius, 0), (0, 0), arrowprops={"arrowstyle": "->", "color": BLACK})
    _draw_body(axes, 0.0, 0.0, BLUE)
    axes.text(-BODY_SIDE / 2, BODY_SIDE / 2, "agent ", ha="right", va="top")
    if sectors:
        last_sector = list(sectors)[-1]
        _draw_item(axes, last_sector, appearance)
    limit = 1.2 * max(radius, 0.8 * BODY_SIDE)
    axes.set(xlim=(-0.9 * limit, 1.2 * limit), ylim=(limit, -limit), aspect="equal")
    axes.axis("off")
    return figure


def _draw_item(axes: Axes, sector: SensorSector, appearance: Appearance) -> None:
    """Draw an item of the last kind in a sector."""
    x, y = _point_on_circle(0.78 * sector.radius, sector.middle_degrees)
    kinds = appearance["item_kinds"]
    color = resolve_color(kinds[-1]["color"]) if kinds else GRAY
    _draw_body(axes, x, y, color)
    axes.text(x, y + 0.55 * BODY_SIDE, "item", ha="center", va="top")


def _draw_sectors(axes: Axes, sectors: Mapping[SensorSector, list[str]], radius: float) -> None:
    last_sector = list(sectors)[-1] if sectors else None
    for sector, names in sectors.items():
        # The last sector contains the item, so it has the color of an active input in the lab.
        color = ORANGE if sector == last_sector else PALE
        edges = (sector.first_degrees, sector.last_degrees)
        axes.add_patch(Wedge((0, 0), sector.radius, *edges, fc=color, alpha=0.55, ec=GRAY, lw=1))
        x, y = _point_on_circle(1.06 * radius, sector.middle_degrees)
        axes.text(x, y, "\n".join(names), ha="left", va="center", fontweight="bold")
    wide_sectors = [sector for sector in sectors if sector.width_degrees > MIN_LABELED_DEGREES]
    edges_degrees = dict.fromkeys(
        degrees
        for sector in wide_sectors
        for degrees in (sector.first_degrees, sector.last_degrees)
    )
    for degrees in edges_degrees:
        x, y = _point_on_circle(1.1 * radius, degrees)
        # The angle between the edge and the heading, 0 to 180.
        degrees_from_heading = abs((degrees + 180) % 360 - 180)
        label = f"{degrees_from_heading:g}°"
        axes.text(x, y, label, ha="center", va="center", color=GRAY)


def _point_on_circle(radius: float, degrees: float) -> tuple[float, float]:
    radians = np.radians(degrees)
    return radius * float(np.cos(radians)), radius * float(np.sin(radians))


def _draw_body(axes: Axes, x: float, y: float, color: str) -> None:
    corner = (x - BODY_SIDE / 2, y - BODY_SIDE / 2)
    axes.add_patch(Rectangle(corner, BODY_SIDE, BODY_SIDE, fill=False, ec=color, lw=1.6))
    axes.plot(x, y, "o", color=color, ms=4)
