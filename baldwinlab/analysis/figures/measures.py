"""Figures of models without a map: shares, fitness by evaluations, measures, and survival."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from baldwinlab.analysis.figures.boxes import draw_box
from baldwinlab.analysis.figures.fitness import plotted_conditions
from baldwinlab.analysis.figures.style import (
    FIGURE_WIDTH,
    choose_style,
    label_generations,
    styled,
    wrap_label,
)
from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.statistics.curve_intervals import interval_of_mean
from baldwinlab.experiment.outcome import name_outcome_of

# Largest number of panels in a row.
MAX_COLUMNS = 3
# Heights of a panel and of the legend, in inches.
PANEL_HEIGHT = 2.2
LEGEND_HEIGHT = 0.5


class MeasureValues(NamedTuple):
    """The values of a measure that a model declares."""

    name: str
    meaning: str
    # Values of the runs, by condition. A run without a value is left out.
    values: Mapping[str, npt.NDArray[np.float64]]


@styled
def draw_shares(shares: xr.Dataset) -> Figure:
    """Draw shares by generation: the mean over runs and its 95 % interval (Student's t).

    `shares`: a variable for each share, 0 to 1, as (condition, run, generation). The figure has a
    panel per condition.
    """
    conditions = plotted_conditions(shares)
    n_rows = math.ceil(len(conditions) / MAX_COLUMNS)
    n_columns = min(MAX_COLUMNS, len(conditions))
    figure = Figure((FIGURE_WIDTH, n_rows * PANEL_HEIGHT + LEGEND_HEIGHT))
    panels = figure.subplots(n_rows, n_columns, squeeze=False, sharey=True)
    # The last row may have fewer conditions than columns.
    for axes in panels.flat[len(conditions) :]:
        axes.remove()
    generation = shares["generation"]
    for axes, condition in zip(panels.flat, conditions, strict=False):
        axes.set_title(condition.name, loc="left", fontweight="bold")
        for share_index, (name, share) in enumerate(shares.items()):
            average, low, high = interval_of_mean(share.sel(condition=condition.name))
            style = choose_style(share_index)
            axes.fill_between(generation, low, high, color=style.color, alpha=0.18, lw=0)
            label = str(name)
            axes.plot(generation, average, color=style.color, ls=style.line, lw=1.5, label=label)
        axes.set_ylim(-0.025, 1.025)
        label_generations(axes)
    for row in panels:
        row[0].set_ylabel("share")
    legend = panels[0, 0].get_legend_handles_labels()
    figure.legend(*legend, loc="outside upper center", ncols=min(len(shares), 4))
    return figure


@styled
def draw_fitness_by_evaluations(dataset: xr.Dataset, evaluations: str) -> Figure:
    """Draw mean fitness by generation and by the number of evaluations, averaged over runs.

    `dataset`: runs as (condition, run, generation, agent).
    """
    figure = Figure((FIGURE_WIDTH, 2.9))
    by_generation, by_evaluation = figure.subplots(1, 2, sharey=True)
    for condition in plotted_conditions(dataset):
        runs = dataset.sel(condition=condition.name)
        average = fitness.mean(runs).mean("run")
        per_generation = runs[evaluations].sum("agent", min_count=1)
        total_evaluations = per_generation.cumsum("generation").mean("run")
        style = condition.style
        line = {
            "color": style.color,
            "ls": style.line,
            "lw": 1.5,
            "marker": style.marker,
            "ms": 3.5,
            "markevery": 8,
        }
        by_generation.plot(dataset["generation"], average, label=condition.name, **line)
        by_evaluation.plot(total_evaluations.where(average.notnull()), average, **line)
    by_evaluation.set_xscale("log")
    by_generation.set(
        xlabel="generation",
        ylabel=wrap_label(name_outcome_of(fitness.outcome(dataset), "average agent")),
    )
    by_evaluation.set_xlabel("evaluations by all agents of a run until then")
    figure.legend(*by_generation.get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


@styled
def draw_measures(dataset: xr.Dataset, measures: Sequence[MeasureValues]) -> Figure:
    """Draw each measure in a panel, with a box per condition and a point per run.

    `measures`: the measures, at least one. The figure has a panel per measure. The conditions of a
    map are next to each other.
    """
    conditions = plotted_conditions(dataset)
    maps = list(dict.fromkeys(condition.map_name for condition in conditions))
    learners = list(dict.fromkeys(condition.learner for condition in conditions))
    # A gap of one position separates the maps.
    positions_per_map = len(learners) + 1
    positions = {
        condition.name: maps.index(condition.map_name) * positions_per_map
        + learners.index(condition.learner)
        for condition in conditions
    }
    has_maps = maps != [""]
    if not has_maps:
        ticks = ([float(position) for position in positions.values()], learners)
    else:
        positions_by_map = {
            name: [positions[item.name] for item in conditions if item.map_name == name]
            for name in maps
        }
        centers = [float(np.mean(map_positions)) for map_positions in positions_by_map.values()]
        ticks = (centers, maps)
    figure = Figure((FIGURE_WIDTH, 0.5 + 2.6 * len(measures)))
    panels = figure.subplots(len(measures), squeeze=False).flat
    for axes, measure in zip(panels, measures, strict=True):
        for condition in conditions:
            values = measure.values[condition.name]
            if values.size:
                draw_box(axes, positions[condition.name], values, condition.style)
        title = measure.meaning[0].upper() + measure.meaning[1:]
        axes.set_title(title, loc="left", fontweight="bold")
        axes.set_xticks(*ticks)
        axes.set_xlim(-0.8, max(positions.values()) + 0.8)
        axes.grid(visible=False, axis="x")
    if has_maps and len(learners) > 1:
        styles = {condition.learner: condition.style for condition in conditions}
        handles = [
            Line2D([], [], color=styles[name].color, marker=styles[name].marker, ms=4, label=name)
            for name in learners
        ]
        figure.legend(handles=handles, loc="outside upper center", ncols=min(len(handles), 4))
    return figure


@styled
def draw_survival(dataset: xr.Dataset) -> Figure:
    """Draw the share of surviving runs by time, for models whose fitness is a survival time.

    `dataset`: runs as (condition, run, generation, agent); `energy` is the survival time.
    """
    figure = Figure((FIGURE_WIDTH, 3.1))
    axes = figure.subplots()
    lifetimes = fitness.final(dataset, "mean", 1)
    start = max(1.0, 0.9 * float(lifetimes.min()))
    for condition in plotted_conditions(dataset):
        times = np.sort(lifetimes.sel(condition=condition.name).dropna("run").values)
        n_deaths = np.arange(1, times.size + 1)
        share_alive = 1 - n_deaths / max(1, times.size)
        # A run that survives to the end of the simulation has no death to draw.
        share_alive[times == float(lifetimes.max())] = np.nan
        style = condition.style
        axes.step(
            [start, *times],
            [1.0, *share_alive],
            where="post",
            color=style.color,
            ls=style.line,
            lw=1.5,
            label=condition.name,
        )
    axes.set(
        xscale="log",
        ylim=(-0.025, 1.025),
        xlabel=str(dataset["energy"].attrs.get("long_name", "time")),
        ylabel="share of runs that survive",
    )
    figure.legend(loc="outside upper center", ncols=5)
    return figure
