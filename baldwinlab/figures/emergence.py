"""How foraging emerges: one population's ways over the map at several generations, and how many agents reach the food.

Source: the paper, "The Emergence of Intelligent Foraging", and its last figure.
"""

from __future__ import annotations

import json
from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from baldwinlab.experiment import World
from baldwinlab.experiment.toml import from_toml
from baldwinlab.figures.style import BLUE, GREY, VERMILION, WIDTH, styled
from baldwinlab.figures.world import lay_out
from baldwinlab.statistics import fitness
from baldwinlab.statistics.fitness import interval_of_mean

PIECES = 40  # of a trajectory, each drawn as strongly as it is late


@styled
def emergence(study: xr.Dataset, traces: Sequence[xr.Dataset]) -> Figure:
    """Above, each of `traces` (lifetimes of one population, three in a row); below, the share of agents that ate, over all runs.

    Raises ValueError where there is no trace.
    """
    if not traces:
        raise ValueError("there is no trace to draw")
    rows = -(-len(traces) // 3)
    figure = Figure((WIDTH, 2.6 * rows + 2.1))
    above, below = figure.subfigures(2, 1, squeeze=False, height_ratios=[2.6 * rows, 2.1])[:, 0]
    grid = above.subplots(rows, 3, squeeze=False)
    for axes, trace in zip(grid.flat, traces, strict=False):
        _trajectories(axes, trace)
    for axes in grid.flat[len(traces) :]:
        axes.set_visible(False)
    _legend(above)
    _share(below.subplots(), study, traces)
    return figure


@styled
def trajectories(trace: xr.Dataset) -> Figure:
    """The ways of all agents over the map in one lifetime, fading towards birth, a dot where each ends."""
    figure = Figure((WIDTH / 2, WIDTH / 2 + 0.5))
    _trajectories(figure.subplots(), trace)
    _legend(figure)
    return figure


def _legend(figure: Figure | SubFigure) -> None:
    handles = [Line2D([], [], color=colour, lw=1.5, label=label) for colour, label in ((BLUE, "ate"), (VERMILION, "never ate"))]
    figure.legend(handles=handles, loc="outside upper center", ncols=2)


def _trajectories(axes: Axes, trace: xr.Dataset) -> None:
    world = from_toml(trace.attrs["experiment"], where="the trace", reading=True).world
    lay_out(axes, world, json.loads(trace.attrs["look"]))
    axes.tick_params(labelbottom=False, labelleft=False, length=0)
    axes.grid(visible=False)
    ate = trace["eaten"].sum("step").values > 0
    axes.set_title(f"Generation {trace.attrs['generation']}: {ate.sum()} of {ate.size} ate", loc="left")
    colours = np.where(ate, BLUE, VERMILION)
    segments, shades = [], []
    for agent in np.argsort(ate, kind="stable"):  # those that never ate lie below
        way = unwrapped(trace["x"].values[:, agent], trace["y"].values[:, agent], world)
        pieces = np.array_split(np.arange(len(way)), min(PIECES, len(way)))
        segments += [way[max(piece[0] - 1, 0) : piece[-1] + 1] for piece in pieces]
        shades += [to_rgba(colours[agent], strength) for strength in 0.05 + 0.75 * np.linspace(0, 1, len(pieces)) ** 3]
    axes.add_collection(LineCollection(segments, colors=shades, linewidths=0.6, rasterized=True), autolim=False)
    axes.scatter(trace["x"].values[-1], trace["y"].values[-1], s=7, c=colours, lw=0, zorder=3)


def unwrapped(x: np.ndarray, y: np.ndarray, world: World) -> np.ndarray:
    """The way [step, 2] as a line, broken by a row of NaN where it leaves the map at one edge and enters at the other."""
    way = np.stack([x, y], axis=1).astype(np.float64)
    leaps = np.abs(np.diff(way, axis=0)) > np.array([world.width, world.height]) / 2
    return np.insert(way, np.flatnonzero(leaps.any(axis=1)) + 1, np.nan, axis=0)


def _share(axes: Axes, study: xr.Dataset, traces: Sequence[xr.Dataset]) -> None:
    condition, run = traces[0].attrs["condition"], traces[0].attrs["run"]
    shares = fitness.share(study).sel(condition=condition)
    average, low, high = interval_of_mean(shares)
    generation = shares["generation"].values
    axes.fill_between(generation, low, high, color=BLUE, alpha=0.2, lw=0)
    axes.plot(
        generation,
        average,
        color=BLUE,
        lw=1.6,
        marker=".",
        ms=3,
        label=f"mean of {int(shares.notnull().any('generation').sum())} runs",
    )
    if run in shares["run"]:
        axes.plot(generation, shares.sel(run=run), color=GREY, lw=0.8, ls=":", label="the population above")
        shown = [trace.attrs["generation"] for trace in traces]
        axes.plot(shown, shares.sel(run=run, generation=shown), "o", color=GREY, ms=4)
    axes.set(xlabel="generation", ylabel="share of agents that ate", ylim=(0, 1.02))
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, steps=[1, 2, 5, 10], min_n_ticks=1))
    axes.legend(loc="lower right", ncols=2)
