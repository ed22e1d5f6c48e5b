"""How foraging emerges: where one population is at several generations, and how many agents reach the food.

Source: the paper, "The Emergence of Intelligent Foraging", and its last figure, which shows where agents went.
"""

from __future__ import annotations

import json
from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import LinearSegmentedColormap, PowerNorm, to_rgba
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from baldwinlab.analysis.figures.fitness import conditions
from baldwinlab.analysis.figures.style import BLUE, GREY, WIDTH, styled
from baldwinlab.analysis.figures.world import lay_out
from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.statistics.fitness import interval_of_mean
from baldwinlab.experiment import World
from baldwinlab.experiment.toml import from_toml

PIECES = 40  # of a trajectory, each drawn as strongly as it is late
CELLS = 32  # along each edge of a map
DARKEST = 1000 / CELLS**2  # per cent: ten times as long in a cell as if everywhere alike
PANEL, GAP, TITLE, BAR, SHARE = (
    2.24,
    0.12,
    0.3,
    0.75,
    2.1,
)  # inches: maps, between and above them; below, the bar and the curve
WHITE_TO_BLUE = LinearSegmentedColormap.from_list("white to blue", ["white", BLUE, "black"])


@styled
def emergence(study: xr.Dataset, traces: Sequence[xr.Dataset]) -> Figure:
    """Above, where the agents of each of `traces` were in their lives, three in a row; below, the share that ate, over all runs.

    `traces` are lifetimes of one population. The shades are those of one scale. Raises ValueError where there is no trace.
    """
    if not traces:
        raise ValueError("there is no trace to draw")
    rows = -(-len(traces) // 3)
    figure = Figure((WIDTH, rows * (PANEL + TITLE) + BAR + SHARE))
    figure.set_layout_engine("none")  # its solver's last digits vary, and a colour bar shows them
    for number, trace in enumerate(traces):
        row, column = divmod(number, 3)
        axes = _axes(
            figure,
            GAP + column * (PANEL + GAP),
            SHARE + BAR + (rows - 1 - row) * (PANEL + TITLE),
            PANEL,
            PANEL,
        )
        drawn = _presence(axes, trace)
    bar = _axes(figure, WIDTH / 4, SHARE + BAR - 0.22, WIDTH / 2, 0.1)
    cell = f"share of all agents' time in a cell of 1/{CELLS} by 1/{CELLS} of the map, %"
    figure.colorbar(
        drawn,
        cax=bar,
        orientation="horizontal",
        extend="max",
        label=cell,
        ticks=[0, 0.1, 0.3, 0.6, 0.9],
    )
    _share(_axes(figure, 0.55, 0.45, WIDTH - 0.65, SHARE - 0.55), study, traces)
    return figure


def _axes(figure: Figure, *inches: float) -> Axes:
    """A panel at a place (left, bottom, width, height)."""
    width, height = figure.get_size_inches()
    left, bottom, wide, high = inches
    return figure.add_axes((left / width, bottom / height, wide / width, high / height))


def density(trace: xr.Dataset) -> np.ndarray:
    """Where agents were: of all their time together, the percentage in each cell of the map, [row, column]."""
    world = _world(trace)
    edges = np.linspace(0, world.height, CELLS + 1), np.linspace(0, world.width, CELLS + 1)
    counts, _, _ = np.histogram2d(trace["y"].values.ravel(), trace["x"].values.ravel(), edges)
    return np.asarray(100 * counts / trace["x"].size)


def _presence(axes: Axes, trace: xr.Dataset) -> AxesImage:
    world = _world(trace)
    _empty_map(axes, trace, world)
    edges, norm = (0, world.width, world.height, 0), PowerNorm(0.5, 0, DARKEST, clip=True)
    return axes.imshow(
        density(trace), WHITE_TO_BLUE, norm, extent=edges, interpolation="nearest", zorder=0
    )


@styled
def trajectories(trace: xr.Dataset) -> Figure:
    """The ways of all agents over the map in one lifetime, fading towards birth, a dot where each ends."""
    figure = Figure((WIDTH / 2, WIDTH / 2 + 0.5))
    _trajectories(figure.subplots(), trace)
    handles = [
        Line2D([], [], color=colour, lw=1.5, label=label)
        for colour, label in ((BLUE, "ate"), (GREY, "never ate"))
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=2)
    return figure


def _trajectories(axes: Axes, trace: xr.Dataset) -> None:
    world = _world(trace)
    ate = _empty_map(axes, trace, world)
    colours = np.where(ate, BLUE, GREY)
    segments, shades = [], []
    for agent in np.argsort(ate, kind="stable"):  # those that never ate lie below
        way = unwrapped(trace["x"].values[:, agent], trace["y"].values[:, agent], world)
        pieces = np.array_split(np.arange(len(way)), min(PIECES, len(way)))
        segments += [way[max(piece[0] - 1, 0) : piece[-1] + 1] for piece in pieces]
        shades += [
            to_rgba(colours[agent], strength)
            for strength in 0.05 + 0.75 * np.linspace(0, 1, len(pieces)) ** 3
        ]
    axes.add_collection(
        LineCollection(segments, colors=shades, linewidths=0.6, rasterized=True), autolim=False
    )
    axes.scatter(trace["x"].values[-1], trace["y"].values[-1], s=7, c=colours, lw=0, zorder=3)


def _world(trace: xr.Dataset) -> World:
    return from_toml(trace.attrs["experiment"], where="the trace", lenient=True).world


def _empty_map(axes: Axes, trace: xr.Dataset, world: World) -> np.ndarray:
    """The map in which a trace was lived, titled with how many ate; gives which agents those are."""
    lay_out(axes, world, json.loads(trace.attrs["look"]))
    axes.tick_params(labelbottom=False, labelleft=False, length=0)
    axes.grid(visible=False)
    ate = np.asarray(trace["eaten"].sum("step").values > 0)
    axes.set_title(
        f"Generation {trace.attrs['generation']}: {ate.sum()} of {ate.size} ate", loc="left"
    )
    return ate


def unwrapped(x: np.ndarray, y: np.ndarray, world: World) -> np.ndarray:
    """The way [step, 2] as a line, broken by a row of NaN where it leaves the map at one edge and enters at the other."""
    way = np.stack([x, y], axis=1).astype(np.float64)
    leaps = np.abs(np.diff(way, axis=0)) > np.array([world.width, world.height]) / 2
    return np.insert(way, np.flatnonzero(leaps.any(axis=1)) + 1, np.nan, axis=0)


def _share(axes: Axes, study: xr.Dataset, traces: Sequence[xr.Dataset]) -> None:
    condition, run = traces[0].attrs["condition"], traces[0].attrs["run"]
    look = next(one.look for one in conditions(study) if one.name == condition)
    shares = fitness.share(study).sel(condition=condition)
    average, low, high = interval_of_mean(shares)
    generation = shares["generation"].values
    label = f"{condition}, mean of {int(shares.notnull().any('generation').sum())} runs"
    axes.fill_between(generation, low, high, color=look.colour, alpha=0.2, lw=0)
    axes.plot(generation, average, color=look.colour, ls=look.line, lw=1.6, label=label)
    if run in shares["run"]:
        axes.plot(
            generation,
            shares.sel(run=run),
            color=GREY,
            lw=0.8,
            ls=":",
            label="the population above",
        )
        shown = [trace.attrs["generation"] for trace in traces]
        axes.plot(shown, shares.sel(run=run, generation=shown), "o", color=GREY, ms=4)
    axes.set(xlabel="generation", ylabel="share of agents that ate", ylim=(0, 1.02))
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, steps=[1, 2, 5, 10], min_n_ticks=1))
    axes.legend(loc="lower right", ncols=2)
