"""Maps to scale, and the paths of agents on them. y increases downward, as on a screen.

A map shows the edges, the birth disc, and the *appearance*: regions and obstacles of the parts. A
trace stores the appearance as an attribute.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Ellipse, Rectangle

from baldwinlab.analysis.appearance import (
    MAX_STEP_LENGTH,
    AgentSymbol,
    list_symbol_numbers,
    list_symbols,
    read_appearance,
)
from baldwinlab.analysis.figures.style import BLUE, FIGURE_WIDTH, GRAY, styled
from baldwinlab.analysis.palette import resolve_color
from baldwinlab.experiment import World
from baldwinlab.experiment.toml import from_toml

# Largest number of segments of a drawn path. Later segments are more opaque.
MAX_SEGMENTS = 40
# Markers of the shapes of species.
SHAPE_MARKERS = {"circle": "o", "triangle": "^", "square": "s", "diamond": "D"}
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
    left, top, width, height = (mark[key] for key in ("x", "y", "width", "height"))
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
    axes.set_title(title)
    return has_eaten


@styled
def draw_trajectories(trace: xr.Dataset) -> Figure:
    """Draw the paths of all agents in one lifetime. A path ends at a marker and fades toward birth.

    Each species has a color and a marker. The marker of an agent that died is hollow.
    """
    figure = Figure((FIGURE_WIDTH / 2, FIGURE_WIDTH / 2 + 0.5))
    axes = figure.subplots()
    has_eaten = draw_titled_map(axes, trace, parse_world(trace))
    symbols = list_symbols(trace)
    if "species" in trace:
        numbers = np.array(list_symbol_numbers(trace))
        colors = np.array([symbol.fill for symbol in symbols])[numbers]
        handles = _draw_species_ends(axes, trace, symbols, numbers)
    else:
        colors = np.where(has_eaten, BLUE, GRAY)
        axes.scatter(trace["x"].values[-1], trace["y"].values[-1], s=7, c=colors, lw=0, zorder=3)
        handles = [
            Line2D([], [], color=color, lw=1.5, label=label)
            for color, label in ((BLUE, "ate"), (GRAY, "never ate"))
        ]
    _draw_paths(axes, trace, colors, has_eaten)
    figure.legend(handles=handles, loc="outside upper center", ncols=min(3, len(handles)))
    return figure


def _draw_species_ends(
    axes: Axes, trace: xr.Dataset, symbols: Sequence[AgentSymbol], numbers: np.ndarray
) -> list[Line2D]:
    """Draw the last position of each agent, and return the entries of the legend."""
    # [agent]: last step with a position. Positions are NaN between a death and the next birth.
    last_steps = trace.sizes["step"] - 1 - np.isfinite(trace["x"].values)[::-1].argmax(axis=0)
    agents = np.arange(trace.sizes["agent"])
    x = trace["x"].values[last_steps, agents]
    y = trace["y"].values[last_steps, agents]
    is_dead = last_steps < trace.sizes["step"] - 1
    handles = []
    for species_index, symbol in enumerate(symbols):
        marker = SHAPE_MARKERS[symbol.shape]
        style: dict[str, Any] = {"color": symbol.fill, "marker": marker, "lw": 0, "ms": 4}
        for selected, face in ((~is_dead, symbol.fill), (is_dead, "white")):
            is_drawn = selected & (numbers == species_index)
            axes.plot(x[is_drawn], y[is_drawn], **style, mfc=face, zorder=3)
        handles.append(Line2D([], [], **style, label=symbol.name))
    if is_dead.any():
        handles.append(
            Line2D([], [], color=GRAY, marker="o", lw=0, ms=4, mfc="white", label="died")
        )
    return handles


def _draw_paths(axes: Axes, trace: xr.Dataset, colors: np.ndarray, has_eaten: np.ndarray) -> None:
    segments = []
    segment_colors = []
    # Agents that never ate (False) are drawn first, below the others.
    for agent in np.argsort(has_eaten, kind="stable"):
        path = split_trails(trace["x"].values[:, agent], trace["y"].values[:, agent])
        n_segments = min(MAX_SEGMENTS, len(path))
        for steps in np.array_split(np.arange(len(path)), n_segments):
            # A segment starts at the last point of the preceding segment, to leave no gap.
            first_step = max(steps[0] - 1, 0)
            segments.append(path[first_step : steps[-1] + 1])
        opacities = 0.05 + 0.75 * np.linspace(0, 1, n_segments) ** 3
        segment_colors += [to_rgba(colors[agent], opacity) for opacity in opacities]
    lines = LineCollection(segments, colors=segment_colors, linewidths=0.6, rasterized=True)
    axes.add_collection(lines, autolim=False)


def split_trails(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return a path [step, 2], with a row of NaN between two trails."""
    path = np.stack([x, y], axis=1).astype(np.float64)
    is_jump = np.abs(np.diff(path, axis=0)).sum(axis=1) > MAX_STEP_LENGTH
    return np.insert(path, np.flatnonzero(is_jump) + 1, np.nan, axis=0)
