"""What models without a world on a plane have to show: shares, two clocks, measures of their own, and how long runs survive."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from baldwinlab.analysis.figures.fitness import box, conditions
from baldwinlab.analysis.figures.style import WIDTH, series, styled
from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.statistics.fitness import interval_of_mean

COLUMNS = 3
HEIGHT = 2.2  # inches, of a panel


class Measured(NamedTuple):
    """What a measure of a model's own comes to."""

    name: str
    meaning: str
    of: Mapping[
        str, npt.NDArray[np.float64]
    ]  # by condition, a value a run; of runs that have none, nothing


@styled
def shares(found: xr.Dataset) -> Figure:
    """Shares (condition, run, generation) by generation, each a variable by its name: a panel a condition.

    The mean over runs, and its 95 % interval (Student's t) where there are two or more.
    """
    shown = conditions(found)
    rows, columns = math.ceil(len(shown) / COLUMNS), min(COLUMNS, len(shown))
    figure = Figure((WIDTH, rows * HEIGHT + 0.5))
    panels = figure.subplots(rows, columns, squeeze=False, sharey=True)
    for axes in panels.flat[len(shown) :]:
        axes.remove()
    for axes, condition in zip(panels.flat, shown, strict=False):
        axes.set_title(condition.name, loc="left", fontweight="bold")
        for number, (name, share) in enumerate(found.items()):
            average, low, high = interval_of_mean(share.sel(condition=condition.name))
            look = series(number)
            axes.fill_between(found["generation"], low, high, color=look.colour, alpha=0.18, lw=0)
            axes.plot(
                found["generation"],
                average,
                color=look.colour,
                ls=look.line,
                lw=1.5,
                label=str(name),
            )
        axes.set_ylim(-0.025, 1.025)
        axes.set_xlabel("generation")
        axes.xaxis.set_major_locator(MaxNLocator(integer=True, steps=[1, 2, 5, 10], min_n_ticks=1))
    for row in panels:
        row[0].set_ylabel("share")
    figure.legend(
        *panels[0, 0].get_legend_handles_labels(),
        loc="outside upper center",
        ncols=min(len(found), 4),
    )
    return figure


@styled
def clocks(study: xr.Dataset, used: str) -> Figure:
    """Fitness of the average agent on two clocks: by generation, and by how often the worlds of a run were asked until then.

    `used` is the variable that counts how often an agent asked. Means over runs.
    """
    figure = Figure((WIDTH, 2.9))
    by_generation, by_use = figure.subplots(1, 2, sharey=True)
    for condition in conditions(study):
        run = study.sel(condition=condition.name)
        average, asked = (
            fitness.mean(run).mean("run"),
            run[used].sum("agent", min_count=1).cumsum("generation").mean("run"),
        )
        look = condition.look
        line = {
            "color": look.colour,
            "ls": look.line,
            "lw": 1.5,
            "marker": look.marker,
            "ms": 3.5,
            "markevery": 8,
        }
        by_generation.plot(study["generation"], average, label=condition.name, **line)
        by_use.plot(asked.where(average.notnull()), average, **line)
    by_use.set_xscale("log")
    by_generation.set(xlabel="generation", ylabel="fitness, average agent")
    by_use.set_xlabel("evaluations by all agents of a run until then")
    figure.legend(*by_generation.get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


@styled
def measures(study: xr.Dataset, found: Sequence[Measured]) -> Figure:
    """A panel a measure: a box for each condition, those of a map side by side, and a point a run."""
    shown = conditions(study)
    maps, learners = (
        list(dict.fromkeys(getattr(one, factor) for one in shown))
        for factor in ("map_name", "learner")
    )
    places = {
        one.name: maps.index(one.map_name) * (len(learners) + 1) + learners.index(one.learner)
        for one in shown
    }
    middles = [
        np.mean([places[one.name] for one in shown if one.map_name == name]) for name in maps
    ]
    figure = Figure((WIDTH, 0.5 + 2.6 * len(found)))
    for axes, measured in zip(figure.subplots(len(found), squeeze=False).flat, found, strict=True):
        for one in shown:
            if measured.of[one.name].size:
                box(axes, places[one.name], measured.of[one.name], one.look)
        axes.set_title(
            measured.meaning[0].upper() + measured.meaning[1:], loc="left", fontweight="bold"
        )
        axes.set_xticks(*((middles, maps) if maps != [""] else (list(places.values()), learners)))
        axes.set_xlim(-0.8, max(places.values()) + 0.8)
        axes.grid(visible=False, axis="x")
    if maps != [""] and len(learners) > 1:
        looks = {one.learner: one.look for one in shown}
        handles = [
            Line2D([], [], color=looks[name].colour, marker=looks[name].marker, ms=4, label=name)
            for name in learners
        ]
        figure.legend(handles=handles, loc="outside upper center", ncols=min(len(handles), 4))
    return figure


@styled
def survival(study: xr.Dataset) -> Figure:
    """The share of runs that survive, by time: of models whose fitness is how long a run's average agent lives."""
    figure = Figure((WIDTH, 3.1))
    axes = figure.subplots()
    lasted = fitness.final(study, "mean", 1)
    first = max(1.0, 0.9 * float(lasted.min()))
    for condition in conditions(study):
        times = np.sort(lasted.sel(condition=condition.name).dropna("run").values)
        left = 1 - np.arange(1, times.size + 1) / max(1, times.size)
        left[times == float(lasted.max())] = np.nan  # who lives still at the end is not seen to die
        look = condition.look
        axes.step(
            [first, *times],
            [1.0, *left],
            where="post",
            color=look.colour,
            ls=look.line,
            lw=1.5,
            label=condition.name,
        )
    axes.set(
        xscale="log",
        ylim=(-0.025, 1.025),
        xlabel=str(study["energy"].attrs.get("long_name", "time")),
        ylabel="share of runs that survive",
    )
    figure.legend(loc="outside upper center", ncols=5)
    return figure
