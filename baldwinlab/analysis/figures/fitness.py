"""Draw fitness by generation and at the end: a row per map, a column for best and mean fitness."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import ceil
from typing import NamedTuple

import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from baldwinlab.analysis.figures.style import (
    FIGURE_WIDTH,
    SeriesStyle,
    choose_style,
    label_generations,
    styled,
    wrap_label,
)
from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.statistics.curve_intervals import interval_of_mean
from baldwinlab.experiment.factors import read_factors

# Heights of the smallest legend, of a row of the legend, and of a panel, in inches.
LEGEND_HEIGHT = 0.5
LEGEND_ROW_HEIGHT = 0.2
PANEL_HEIGHT = 2.5
# Largest number of columns of the legend, and the width of its line and gaps, in letters.
MAX_LEGEND_COLUMNS = 4
LEGEND_LINE_LETTERS = 8
# Length of a vertical label, in inches per letter.
LETTER_INCHES = 0.075
# Largest number of markers on a curve.
MAX_MARKERS = 8
# Titles of the columns by measure.
MEASURE_TITLES = {"best": "best agent", "mean": "average agent"}


class PlottedCondition(NamedTuple):
    """A condition, its factors and its appearance."""

    name: str
    learner: str
    map_name: str
    style: SeriesStyle


def plotted_conditions(dataset: xr.Dataset) -> list[PlottedCondition]:
    """Return the conditions in the order of the study. A learner has one style on all maps."""
    factors = read_factors(dataset)
    learners = list(dict.fromkeys(levels.learner for levels in factors.values()))
    return [
        PlottedCondition(
            name=name,
            learner=levels.learner,
            map_name=levels.map,
            style=choose_style(learners.index(levels.learner)),
        )
        for name, levels in factors.items()
    ]


class _Panel(NamedTuple):
    axes: Axes
    measure: str
    conditions: list[PlottedCondition]


def make_panels(
    figure: Figure, dataset: xr.Dataset, is_single_column: bool = False
) -> Iterator[_Panel]:
    """Yield a panel for each map and measure, with the conditions to draw in it."""
    conditions = plotted_conditions(dataset)
    maps = list(dict.fromkeys(condition.map_name for condition in conditions))
    columns = 1 if is_single_column else len(MEASURE_TITLES)
    grid = figure.subplots(len(maps) * len(MEASURE_TITLES) // columns, columns, squeeze=False)
    for row, map_name in zip(grid.reshape(len(maps), -1), maps, strict=True):
        conditions_on_map = [
            condition for condition in conditions if condition.map_name == map_name
        ]
        for axes, (measure, measure_title) in zip(row, MEASURE_TITLES.items(), strict=True):
            title = f"Map {map_name}, {measure_title}" if map_name else measure_title.capitalize()
            axes.set_title(title, loc="left", fontweight="bold")
            axes.set_ylabel(wrap_label(fitness.outcome(dataset)))
            yield _Panel(axes, measure, conditions_on_map)
            # The caller has drawn the panel now, so its limit is known.
            top = panel_top(axes)
            axes.set_ylim(-0.025 * top, top)


def panel_top(axes: Axes) -> float:
    """Return the upper limit of a panel, or 1 if no fitness is above 0."""
    return axes.get_ylim()[1] if axes.dataLim.y1 > 0 else 1.0


def _count_legend_columns(labels: Sequence[str]) -> int:
    """Return the number of columns whose labels fit next to each other."""
    letters = max(map(len, labels), default=0) + LEGEND_LINE_LETTERS
    n_columns = int(FIGURE_WIDTH / (LETTER_INCHES * letters))
    return min(max(1, n_columns), MAX_LEGEND_COLUMNS, len(labels))


@styled
def draw_fitness_curves(dataset: xr.Dataset) -> Figure:
    """Draw fitness by generation: the mean over runs and its 95 % interval (Student's t).

    `dataset`: runs as (condition, run, generation, agent). The figure has a row per map, a column
    for best and mean fitness. A single run has no interval.
    """
    conditions = plotted_conditions(dataset)
    learners = {condition.learner: condition.style for condition in reversed(conditions)}
    n_columns = _count_legend_columns(list(learners))
    legend_height = max(LEGEND_HEIGHT, LEGEND_ROW_HEIGHT * ceil(len(learners) / n_columns))
    n_maps = len({condition.map_name for condition in conditions})
    figure = Figure((FIGURE_WIDTH, legend_height + PANEL_HEIGHT * n_maps))
    tables = {measure: fitness.MEASURES[measure](dataset) for measure in MEASURE_TITLES}
    for axes, measure, conditions_on_map in make_panels(figure, dataset):
        for condition in conditions_on_map:
            _draw_curve(axes, tables[measure].sel(condition=condition.name), condition.style)
        label_generations(axes)
    handles = [
        figure.axes[0].plot(
            [], [], color=style.color, ls=style.line, marker=style.marker, ms=4, label=learner
        )[0]
        for learner, style in reversed(learners.items())
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=n_columns)
    return figure


def _draw_curve(axes: Axes, values: xr.DataArray, style: SeriesStyle) -> None:
    average, low, high = interval_of_mean(values)
    generation = values["generation"].values
    axes.fill_between(generation, low, high, color=style.color, alpha=0.18, lw=0)
    axes.plot(
        generation,
        average,
        color=style.color,
        ls=style.line,
        lw=1.5,
        marker=style.marker,
        ms=3.5,
        markevery=max(1, len(generation) // MAX_MARKERS),
    )
