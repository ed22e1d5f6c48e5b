"""Maps with the birth disc, the regions of items, and an example of agents and items.

If the parts are not installed, a map shows the regions of food.

Source: N. Le (2019), "The Simulated World of Foods and Agents".
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from baldwinlab.analysis.figures.style import BLACK, BLUE, FIGURE_WIDTH, styled
from baldwinlab.analysis.figures.world import (
    LABEL_DISTANCE,
    Appearance,
    draw_empty_map,
    select_item_regions,
)
from baldwinlab.analysis.palette import resolve_color
from baldwinlab.analysis.report.content import select_foragers, title_worlds
from baldwinlab.analysis.report.data import ReportData
from baldwinlab.analysis.report.sections import ReportFigure
from baldwinlab.experiment import FoodRegion, World
from baldwinlab.experiment.conditions import read_factors

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
# Seed of the example positions.
EXAMPLE_SEED = 1906
# A white outline makes text readable on items.
TEXT_HALO = [withStroke(linewidth=2, foreground="white")]


def draw_figure(report: ReportData) -> ReportFigure | None:
    """Draw the maps with examples of agents and items, or return None without MiniWorld."""
    conditions = select_foragers(report.experiments)
    if not conditions:
        return None
    titles = title_worlds(conditions, read_factors(report.data))
    worlds = {title: conditions[name].world for title, name in titles.items()}
    appearances = {
        title: report.appearances[name]
        for title, name in titles.items()
        if name in report.appearances
    }
    starts = [
        f"{title}: agents start around ({world.start.x:g}, {world.start.y:g})"
        for title, world in worlds.items()
    ]
    n_agents = min(experiment.population.size for experiment in conditions.values())
    return ReportFigure(
        title="The maps",
        caption=(
            "Maps to scale, in map units, with y pointing down. An agent that leaves a map at one "
            "edge enters it at the opposite edge. The positions of agents (blue, with a line in "
            "the direction of their heading) and of items are examples."
        ),
        alternative=f"{'; '.join(starts)}.",
        figure=draw_world_maps(worlds, n_agents, appearances),
        table=_tabulate_areas(worlds),
    )


def _tabulate_areas(worlds: Mapping[str, World]) -> list[dict[str, Any]]:
    """Return the areas of maps: one row per birth disc and per region of items."""
    rows: list[dict[str, Any]] = []
    for title, world in worlds.items():
        start = world.start
        size = {"map": title, "map_width": world.width, "map_height": world.height}
        edges = (start.x - start.radius, start.x + start.radius)
        heights = (start.y - start.radius, start.y + start.radius)
        areas = [("birth disc", edges, heights, 0)]
        areas += [("items", region.x, region.y, region.count) for region in world.food]
        for area, (left, right), (upper, lower), count in areas:
            sides = {"left": left, "right": right, "upper": upper, "lower": lower}
            rows.append(size | {"area": area} | sides | {"items": count})
    return rows


@styled
def draw_world_maps(
    worlds: Mapping[str, World],
    agents: int,
    appearances: Mapping[str, Appearance] = MappingProxyType({}),
) -> Figure:
    """Draw maps with the birth disc, the regions of items, and an example of agents and items.

    `agents`: number of example agents. `appearances`: appearances by title. A world without an
    appearance shows its food.
    """
    n_columns = min(len(worlds), MAX_COLUMNS)
    n_rows = math.ceil(len(worlds) / n_columns)
    width = min(FIGURE_WIDTH, MAX_MAP_WIDTH * n_columns)
    row_height = NARROW_MAP_HEIGHT if n_columns == MAX_COLUMNS else WIDE_MAP_HEIGHT
    figure = Figure((width, n_rows * row_height))
    grid = figure.subplots(n_rows, n_columns, squeeze=False)
    for axes, (title, world) in zip(grid.flat, worlds.items(), strict=False):
        _draw_map(axes, world, agents, appearances.get(title) or make_food_appearance(world))
        axes.set_title(title)
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
    box = {"x": left, "y": top, "width": right - left, "height": bottom - top}
    return {"kind": "rectangle", **box, "color": "green", "label": "food", "solid": False}


def _draw_map(axes: Axes, world: World, agents: int, appearance: Appearance) -> None:
    generator = np.random.default_rng(EXAMPLE_SEED)
    draw_empty_map(axes, world, appearance)
    _draw_agents(axes, world, agents, generator)
    # Regions with the same left, right and upper edges have one common label.
    labels: dict[tuple[float, float, float], list[str]] = {}
    for region, kind in zip(select_item_regions(appearance), appearance["item_kinds"], strict=True):
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
        # A label in the right half ends at the edge of the region, and so fits on the map.
        is_right = center > world.width / 2
        x = right if is_right else center
        alignment = "right" if is_right else "center"
        text = ", ".join(texts)
        axes.annotate(text, (x, height), ha=alignment, va="bottom", path_effects=TEXT_HALO)


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
    # The square root makes the positions uniform in the disc.
    angle = generator.uniform(0, 2 * np.pi, agents)
    distance = start.radius * np.sqrt(generator.uniform(size=agents))
    x = start.x + distance * np.cos(angle)
    y = start.y + distance * np.sin(angle)
    _draw_squares(axes, x, y, BLUE)
    is_rasterized = agents > MAX_VECTOR_SHAPES
    axes.hlines(y, x, x + 1.2 * BODY_SIDE, color=BLACK, lw=0.9, rasterized=is_rasterized)


def _draw_squares(axes: Axes, x: np.ndarray, y: np.ndarray, color: str) -> None:
    centers = np.stack([x, y], axis=-1)
    corners = BODY_SIDE / 2 * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    squares = PolyCollection(
        list(centers[:, None] + corners),  # [square, corner, (x, y)]
        facecolor=color,
        edgecolor="white",
        linewidth=0.3,
        rasterized=len(centers) > MAX_VECTOR_SHAPES,
    )
    axes.add_collection(squares)
