"""Figure of the evolution of foraging: positions of agents by generation, and shares that ate.

Source: the last figure of N. Le (2019), in the section "The Emergence of Intelligent Foraging".
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import LinearSegmentedColormap, PowerNorm, to_rgba
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D

from baldwinlab.analysis.agent_symbols import AgentSymbol, list_symbol_numbers, list_symbols
from baldwinlab.analysis.figures.fitness import plotted_conditions
from baldwinlab.analysis.figures.style import BLUE, FIGURE_WIDTH, GRAY, label_generations, styled
from baldwinlab.analysis.figures.world import draw_empty_map
from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.statistics.curve_intervals import interval_of_mean
from baldwinlab.analysis.traces import read_appearance
from baldwinlab.experiment import World
from baldwinlab.experiment.toml import from_toml

# Largest number of segments of a trajectory. Later segments are more opaque.
MAX_SEGMENTS = 40
# Number of maps in a row.
N_COLUMNS = 3
# Number of cells along each edge of a map.
N_CELLS = 32
# The darkest color marks ten times the percentage that equal time in all cells would give.
DARKEST_PERCENT = 1000 / N_CELLS**2
# Layout, in inches: side of a map, space between and above maps, and heights below the maps.
MAP_SIDE = 2.24
MAP_GAP = 0.12
TITLE_HEIGHT = 0.3
COLOR_BAR_HEIGHT = 0.75
CURVE_HEIGHT = 2.1
# Markers of the shapes of species.
SHAPE_MARKERS = {"circle": "o", "triangle": "^", "square": "s", "diamond": "D"}
WHITE_TO_BLUE = LinearSegmentedColormap.from_list("white to blue", ["white", BLUE, "black"])


@styled
def draw_emergence(dataset: xr.Dataset, traces: Sequence[xr.Dataset]) -> Figure:
    """Draw the positions of the agents of one population, and the share of agents that eat.

    `dataset`: runs as (condition, run, generation, agent). Above, maps of the time per cell. Below,
    the share of agents that eat, in all runs.
    """
    if not traces:
        raise ValueError("there is no trace to draw")
    n_rows = math.ceil(len(traces) / N_COLUMNS)
    figure_height = n_rows * (MAP_SIDE + TITLE_HEIGHT) + COLOR_BAR_HEIGHT + CURVE_HEIGHT
    figure = Figure((FIGURE_WIDTH, figure_height))
    maps_bottom = CURVE_HEIGHT + COLOR_BAR_HEIGHT
    # The layout engine is not reproducible to the last digit, which changes the color bar.
    figure.set_layout_engine("none")
    for trace_index, trace in enumerate(traces):
        row, column = divmod(trace_index, N_COLUMNS)
        left = MAP_GAP + column * (MAP_SIDE + MAP_GAP)
        # The first row is at the top.
        n_rows_below = n_rows - 1 - row
        bottom = maps_bottom + n_rows_below * (MAP_SIDE + TITLE_HEIGHT)
        axes = _add_axes(figure, left, bottom, MAP_SIDE, MAP_SIDE)
        image = _draw_time_shares(axes, trace)
    bar = _add_axes(figure, FIGURE_WIDTH / 4, maps_bottom - 0.22, FIGURE_WIDTH / 2, 0.1)
    figure.colorbar(
        image,
        cax=bar,
        orientation="horizontal",
        extend="max",
        label=f"share of all agents' time in a cell of 1/{N_CELLS} by 1/{N_CELLS} of the map, %",
        ticks=[0, 0.1, 0.3, 0.6, 0.9],
    )
    curve = _add_axes(figure, 0.55, 0.45, FIGURE_WIDTH - 0.65, CURVE_HEIGHT - 0.55)
    _draw_share_that_ate(curve, dataset, traces)
    return figure


def _add_axes(figure: Figure, left: float, bottom: float, width: float, height: float) -> Axes:
    """Add a panel. Positions and sizes are in inches."""
    figure_width, figure_height = figure.get_size_inches()
    return figure.add_axes(
        (
            left / figure_width,
            bottom / figure_height,
            width / figure_width,
            height / figure_height,
        )
    )


def compute_time_shares(trace: xr.Dataset) -> np.ndarray:
    """Return the percentage of all agents' time in each cell of the map, [row, column]."""
    world = _parse_world(trace)
    row_edges = np.linspace(0, world.height, N_CELLS + 1)
    column_edges = np.linspace(0, world.width, N_CELLS + 1)
    y = trace["y"].values.ravel()
    x = trace["x"].values.ravel()
    counts, _, _ = np.histogram2d(y, x, (row_edges, column_edges))
    return np.asarray(100 * counts / trace["x"].size)


def _draw_time_shares(axes: Axes, trace: xr.Dataset) -> AxesImage:
    world = _parse_world(trace)
    _draw_titled_map(axes, trace, world)
    return axes.imshow(
        compute_time_shares(trace),
        WHITE_TO_BLUE,
        PowerNorm(gamma=0.5, vmin=0, vmax=DARKEST_PERCENT, clip=True),
        extent=(0, world.width, world.height, 0),
        interpolation="nearest",
        zorder=0,
    )


@styled
def draw_trajectories(trace: xr.Dataset) -> Figure:
    """Draw the paths of all agents in one lifetime, which end at a dot and fade toward birth.

    Each species has a color and a shape, which is hollow for agents that died.
    """
    figure = Figure((FIGURE_WIDTH / 2, FIGURE_WIDTH / 2 + 0.5))
    axes = figure.subplots()
    world = _parse_world(trace)
    has_eaten = _draw_titled_map(axes, trace, world)
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
    _draw_paths(axes, trace, world, colors, has_eaten)
    figure.legend(handles=handles, loc="outside upper center", ncols=min(3, len(handles)))
    return figure


def _draw_species_ends(
    axes: Axes, trace: xr.Dataset, symbols: Sequence[AgentSymbol], numbers: np.ndarray
) -> list[Line2D]:
    """Draw the last position of each agent, and return the entries of the legend."""
    last_steps = np.isfinite(trace["x"].values).sum(axis=0) - 1
    agents = np.arange(trace.sizes["agent"])
    x = trace["x"].values[last_steps, agents]
    y = trace["y"].values[last_steps, agents]
    is_dead = last_steps < trace.sizes["step"] - 1
    handles = []
    for species_index, symbol in enumerate(symbols):
        style: dict[str, Any] = {
            "color": symbol.fill,
            "marker": SHAPE_MARKERS[symbol.shape],
            "lw": 0,
            "ms": 4,
        }
        for selected, face in ((~is_dead, symbol.fill), (is_dead, "white")):
            is_drawn = selected & (numbers == species_index)
            axes.plot(x[is_drawn], y[is_drawn], **style, mfc=face, zorder=3)
        handles.append(Line2D([], [], **style, label=symbol.name))
    if is_dead.any():
        handles.append(
            Line2D([], [], color=GRAY, marker="o", lw=0, ms=4, mfc="white", label="died")
        )
    return handles


def _draw_paths(
    axes: Axes, trace: xr.Dataset, world: World, colors: np.ndarray, has_eaten: np.ndarray
) -> None:
    segments = []
    segment_colors = []
    # Agents that never ate are drawn first, below the others.
    for agent in np.argsort(has_eaten, kind="stable"):
        path = split_at_edges(trace["x"].values[:, agent], trace["y"].values[:, agent], world)
        n_segments = min(MAX_SEGMENTS, len(path))
        for steps in np.array_split(np.arange(len(path)), n_segments):
            # A segment starts at the last point of the preceding one.
            first_step = max(steps[0] - 1, 0)
            segments.append(path[first_step : steps[-1] + 1])
        opacities = 0.05 + 0.75 * np.linspace(0, 1, n_segments) ** 3
        segment_colors += [to_rgba(colors[agent], opacity) for opacity in opacities]
    lines = LineCollection(segments, colors=segment_colors, linewidths=0.6, rasterized=True)
    axes.add_collection(lines, autolim=False)


def _parse_world(trace: xr.Dataset) -> World:
    return from_toml(trace.attrs["experiment"], source="the trace", lenient=True).world


def _draw_titled_map(axes: Axes, trace: xr.Dataset, world: World) -> np.ndarray:
    """Draw the map of a trace and its title, and return whether each agent ate, [agent]."""
    draw_empty_map(axes, world, read_appearance(trace))
    axes.tick_params(labelbottom=False, labelleft=False, length=0)
    axes.grid(visible=False)
    has_eaten = np.asarray(trace["eaten"].sum("step").values > 0)
    generation = trace.attrs["generation"]
    title = f"Generation {generation}: {has_eaten.sum()} of {has_eaten.size} ate"
    axes.set_title(title, loc="left")
    return has_eaten


def split_at_edges(x: np.ndarray, y: np.ndarray, world: World) -> np.ndarray:
    """Return a path [step, 2], with a row of NaN where an agent crosses the edge of the map."""
    path = np.stack([x, y], axis=1).astype(np.float64)
    half_map = np.array([world.width, world.height]) / 2
    # No agent moves by half a map in a step.
    crosses_edge = (np.abs(np.diff(path, axis=0)) > half_map).any(axis=1)
    steps_after_edge = np.flatnonzero(crosses_edge) + 1
    return np.insert(path, steps_after_edge, np.nan, axis=0)


def _draw_share_that_ate(axes: Axes, dataset: xr.Dataset, traces: Sequence[xr.Dataset]) -> None:
    name = traces[0].attrs["condition"]
    run = traces[0].attrs["run"]
    conditions = plotted_conditions(dataset)
    style = next(condition.style for condition in conditions if condition.name == name)
    shares = fitness.share(dataset).sel(condition=name)
    average, low, high = interval_of_mean(shares)
    generation = shares["generation"].values
    n_runs = int(shares.notnull().any("generation").sum())
    label = f"{name}, mean of {n_runs} runs"
    axes.fill_between(generation, low, high, color=style.color, alpha=0.2, lw=0)
    axes.plot(generation, average, color=style.color, ls=style.line, lw=1.6, label=label)
    if run in shares["run"]:
        run_shares = shares.sel(run=run)
        axes.plot(generation, run_shares, color=GRAY, lw=0.8, ls=":", label="the population above")
        generations = [trace.attrs["generation"] for trace in traces]
        axes.plot(generations, run_shares.sel(generation=generations), "o", color=GRAY, ms=4)
    axes.set(ylabel="share of agents that eat", ylim=(0, 1.02))
    label_generations(axes)
    axes.legend(loc="lower right", ncols=2)
