"""Fitness by generation: a row per map, with a panel each for best and mean fitness."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import ceil
from types import MappingProxyType
from typing import NamedTuple

import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from baldwinlab.analysis.figures.curves import (
    count_legend_columns,
    draw_curve,
    start_at_zero,
)
from baldwinlab.analysis.figures.line_labels import label_lines
from baldwinlab.analysis.figures.style import (
    FIGURE_WIDTH,
    PlottedCondition,
    group_by_map,
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
from baldwinlab.analysis.report.data import ReportData, format_replay_command
from baldwinlab.analysis.report.figures import declare_figure
from baldwinlab.analysis.report.sections import ReportFigure
from baldwinlab.analysis.results.headlines import name_learners
from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.statistics.intervals import interval_of_median
from baldwinlab.experiment.conditions import title_map
from baldwinlab.experiment.outcome import describe_measures

# Heights of the smallest legend, of a row of the legend, and of a panel, in inches.
LEGEND_HEIGHT = 0.5
LEGEND_ROW_HEIGHT = 0.2
PANEL_HEIGHT = 2.5
# Titles of the columns by measure.
MEASURE_TITLES = {"best": "best agent", "mean": "average agent"}


@declare_figure(needs_world=True)
def draw_figure(report: ReportData) -> ReportFigure:
    return draw_measures(report, tuple(MEASURE_TITLES))


def draw_measures(report: ReportData, measures: Sequence[str]) -> ReportFigure:
    """Draw the curves of one or both measures of `MEASURE_TITLES`, or of the share of eaters."""
    data = report.data
    titles = describe_measures(fitness.outcome(data))
    is_single = len(measures) == 1
    name = titles[measures[0]]["title"] if is_single else name_fitness(data, "best", "average")
    names = name_learners(report.contrasts) if report.contrasts else {}
    meanings = "; ".join(f"{learner}: {words}" for learner, words in names.items())
    return ReportFigure(
        title="Fitness over generations",
        caption=(
            f"{name} of each generation. Lines are medians "
            f"over runs. Bands are 95 % intervals of the median.{f' {meanings}.' if names else ''}"
        ),
        alternative=(
            "Curves of fitness by generation for each condition. "
            f"{describe_final_medians(data, report.last)}"
        ),
        figure=draw_fitness_curves(data, measures, names),
        table=[row for measure in measures for row in tabulate_generations(data, measure)],
        commands=[format_replay_command(life) for life in report.lives.values()]
        if "food_eaten" in data
        else (),
    )


class Panel(NamedTuple):
    """A panel, with the measure and the conditions to draw."""

    axes: Axes
    measure: str
    conditions: list[PlottedCondition]


def make_panels(
    figure: Figure,
    dataset: xr.Dataset,
    is_single_column: bool = False,
    measures: Sequence[str] = tuple(MEASURE_TITLES),
) -> Iterator[Panel]:
    """Yield a panel for each map and measure, with the conditions to draw.

    The panels of a measure get the same vertical axis, so that maps can be compared.
    """
    maps = group_by_map(dataset)
    columns = 1 if is_single_column else len(measures)
    grid = figure.subplots(len(maps) * len(measures) // columns, columns, squeeze=False)
    texts = describe_measures(fitness.outcome(dataset))
    # The reshaped grid is [map, measure].
    panels = grid.reshape(len(maps), -1)
    for row, (map_name, conditions_on_map) in zip(panels, maps.items(), strict=True):
        for axes, measure in zip(row, measures, strict=True):
            measure_title = MEASURE_TITLES.get(measure, texts[measure]["title"])
            title = (
                f"{title_map(map_name)}, {measure_title}"
                if map_name
                else measure_title.capitalize()
            )
            axes.set_title(title)
            axes.set_ylabel(wrap_label(texts[measure]["axis"]))
            yield Panel(axes, measure, conditions_on_map)
            # The caller has drawn into the panel now, so the upper limit is known.
            start_at_zero(axes)
    for column in panels.T:
        limits = [axes.get_ylim() for axes in column]
        for axes in column:
            axes.set_ylim(min(low for low, _ in limits), max(high for _, high in limits))


@styled
def draw_fitness_curves(
    dataset: xr.Dataset,
    measures: Sequence[str] = tuple(MEASURE_TITLES),
    names: Mapping[str, str] = MappingProxyType({}),
) -> Figure:
    """Draw fitness by generation, with intervals: a row per map, a column per measure.

    `names`: labels of learners, by default their names.
    """
    conditions = style_conditions(dataset)
    labels = {
        condition.learner: names.get(condition.learner, condition.learner)
        for condition in conditions
    }
    learners = {labels[condition.learner]: condition.style for condition in conditions}
    n_legend_rows = ceil(len(learners) / count_legend_columns(learners))
    legend_height = max(LEGEND_HEIGHT, LEGEND_ROW_HEIGHT * n_legend_rows)
    figure = Figure((FIGURE_WIDTH, legend_height + PANEL_HEIGHT * len(group_by_map(dataset))))
    tables = {measure: fitness.MEASURES[measure](dataset) for measure in measures}
    for axes, measure, conditions_on_map in make_panels(figure, dataset, measures=measures):
        for condition in conditions_on_map:
            values = tables[measure].sel(condition=condition.name)
            label = labels[condition.learner]
            draw_curve(axes, interval_of_median(values), condition.style, label)
        label_generations(axes)
    label_lines(figure, learners)
    return figure
