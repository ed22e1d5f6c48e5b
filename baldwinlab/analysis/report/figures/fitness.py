"""Fitness by generation: a row per map, with a panel each for best and mean fitness."""

from __future__ import annotations

from collections.abc import Iterator
from math import ceil
from typing import NamedTuple

import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from baldwinlab.analysis.figures.curves import (
    count_legend_columns,
    draw_curve,
    draw_legend,
    start_at_zero,
)
from baldwinlab.analysis.figures.style import (
    FIGURE_WIDTH,
    PlottedCondition,
    label_generations,
    style_conditions,
    styled,
    wrap_label,
)
from baldwinlab.analysis.report.content import (
    describe_final_medians,
    name_fitness,
    tabulate_generations,
)
from baldwinlab.analysis.report.data import ReportData, list_replay_commands
from baldwinlab.analysis.report.figures import declare_figure
from baldwinlab.analysis.report.sections import ReportFigure
from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.statistics.intervals import interval_of_median

# Heights of the smallest legend, of a row of the legend, and of a panel, in inches.
LEGEND_HEIGHT = 0.5
LEGEND_ROW_HEIGHT = 0.2
PANEL_HEIGHT = 2.5
# Titles of the columns by measure.
MEASURE_TITLES = {"best": "best agent", "mean": "average agent"}


@declare_figure(needs_world=True)
def draw_figure(report: ReportData) -> ReportFigure:
    data = report.data
    return ReportFigure(
        title="Fitness over generations",
        caption=(
            f"{name_fitness(data, 'best', 'average')} of each generation. Lines are medians "
            "over runs. Bands are 95 % intervals of the median."
        ),
        alternative=(
            "Curves of fitness by generation for each condition. "
            f"{describe_final_medians(data, report.last)}"
        ),
        figure=draw_fitness_curves(data),
        table=[row for measure in ("best", "mean") for row in tabulate_generations(data, measure)],
        commands=list_replay_commands(report.lives) if "food_eaten" in data else (),
    )


class Panel(NamedTuple):
    """A panel, with the measure and the conditions to draw."""

    axes: Axes
    measure: str
    conditions: list[PlottedCondition]


def make_panels(
    figure: Figure, dataset: xr.Dataset, is_single_column: bool = False
) -> Iterator[Panel]:
    """Yield a panel for each map and measure, with the conditions to draw."""
    conditions = style_conditions(dataset)
    maps = list(dict.fromkeys(condition.map_name for condition in conditions))
    columns = 1 if is_single_column else len(MEASURE_TITLES)
    grid = figure.subplots(len(maps) * len(MEASURE_TITLES) // columns, columns, squeeze=False)
    # The reshaped grid is [map, measure].
    for row, map_name in zip(grid.reshape(len(maps), -1), maps, strict=True):
        conditions_on_map = [
            condition for condition in conditions if condition.map_name == map_name
        ]
        for axes, (measure, measure_title) in zip(row, MEASURE_TITLES.items(), strict=True):
            title = f"Map {map_name}, {measure_title}" if map_name else measure_title.capitalize()
            axes.set_title(title, loc="left", fontweight="bold")
            axes.set_ylabel(wrap_label(fitness.outcome(dataset)))
            yield Panel(axes, measure, conditions_on_map)
            # The caller has drawn into the panel now, so the upper limit is known.
            start_at_zero(axes)


@styled
def draw_fitness_curves(dataset: xr.Dataset) -> Figure:
    """Draw fitness by generation, with intervals: a row per map, a column per measure."""
    conditions = style_conditions(dataset)
    learners = {condition.learner: condition.style for condition in conditions}
    n_legend_rows = ceil(len(learners) / count_legend_columns(learners))
    legend_height = max(LEGEND_HEIGHT, LEGEND_ROW_HEIGHT * n_legend_rows)
    n_maps = len({condition.map_name for condition in conditions})
    figure = Figure((FIGURE_WIDTH, legend_height + PANEL_HEIGHT * n_maps))
    tables = {measure: fitness.MEASURES[measure](dataset) for measure in MEASURE_TITLES}
    for axes, measure, conditions_on_map in make_panels(figure, dataset):
        for condition in conditions_on_map:
            values = tables[measure].sel(condition=condition.name)
            draw_curve(axes, interval_of_median(values), condition.style)
        label_generations(axes)
    draw_legend(figure, learners)
    return figure
