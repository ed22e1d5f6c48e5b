"""Maps to scale. y increases downward, as on a screen.

A map shows its edges, the birth disc, and the *appearance* that the parts declare. Traces store
the appearance as an attribute.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Ellipse, Rectangle

from baldwinlab.analysis.figures.style import BLUE
from baldwinlab.analysis.palette import resolve_color
from baldwinlab.analysis.traces import read_appearance
from baldwinlab.experiment import World
from baldwinlab.experiment.toml import from_toml

# Distance of a label from its region, in map units.
LABEL_DISTANCE = 8

Appearance = Mapping[str, Any]
"""`models.miniworld.appearance.Appearance` as plain data."""


def select_item_regions(appearance: Appearance) -> list[Mapping[str, Any]]:
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
    for region in select_item_regions(appearance):
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


def parse_world(trace: xr.Dataset) -> World:
    """Return the world of a trace."""
    return from_toml(trace.attrs["experiment"], source="the trace", lenient=True).world


def draw_titled_map(axes: Axes, trace: xr.Dataset, world: World) -> np.ndarray:
    """Draw the map of a trace and its title, and return whether each agent ate, [agent]."""
    draw_empty_map(axes, world, read_appearance(trace))
    axes.tick_params(labelbottom=False, labelleft=False, length=0)
    axes.grid(visible=False)
    has_eaten = np.asarray(trace["eaten"].sum("step").values > 0)
    generation = trace.attrs["generation"]
    title = f"Generation {generation}: {has_eaten.sum()} of {has_eaten.size} ate"
    axes.set_title(title, loc="left")
    return has_eaten
