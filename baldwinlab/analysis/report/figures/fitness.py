"""Curves of fitness by generation and by evaluations, and of the survival of populations.

Fitness by generation has a row per map, with a panel each for best and mean fitness. Learning uses
many evaluations per generation. Survival is for models whose fitness is a survival time.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import ceil
from types import MappingProxyType
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from baldwinlab.analysis.figures.curves import (
    count_legend_columns,
    draw_curve,
    draw_line,
    start_at_zero,
    use_log_scale,
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
    find_evaluation_variable,
    name_fitness,
    tabulate_generations,
    tabulate_runs,
)
from baldwinlab.analysis.report.data import ReportData, format_replay_command
from baldwinlab.analysis.report.sections import ReportFigure
from baldwinlab.analysis.results.headlines import name_learners
from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.statistics.intervals import interval_of_median
from baldwinlab.experiment.conditions import title_map
from baldwinlab.experiment.outcome import describe_measures, name_outcome_of

# Heights of the smallest legend, of a row of the legend, and of a panel, in inches.
LEGEND_HEIGHT = 0.5
LEGEND_ROW_HEIGHT = 0.2
PANEL_HEIGHT = 2.5
# Titles of the columns by measure.
MEASURE_TITLES = {"best": "best agent", "mean": "average agent"}


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


def make_panels(
    figure: Figure,
    dataset: xr.Dataset,
    is_single_column: bool = False,
    measures: Sequence[str] = tuple(MEASURE_TITLES),
) -> Iterator[tuple[Axes, str, list[PlottedCondition]]]:
    """Yield a panel for each map and measure, with the measure and the conditions to draw.

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
            yield axes, measure, conditions_on_map
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


def draw_evaluations_figure(report: ReportData) -> ReportFigure | None:
    evaluation_variable = find_evaluation_variable(report.experiments)
    if not evaluation_variable:
        return None
    return ReportFigure(
        title="Fitness by generations and by evaluations",
        caption=(
            f"{name_fitness(report.data, 'average')}, mean over runs. The horizontal axis is the "
            "generation, or the total number of evaluations by all agents of a run. Learning uses "
            "many evaluations within one generation."
        ),
        alternative=(
            "The same curves of fitness by generation and by evaluations. "
            f"{describe_final_medians(report.data, 1)}"
        ),
        figure=draw_fitness_by_evaluations(report.data, evaluation_variable),
        table=_tabulate_averages(report.data, evaluation_variable),
    )


@styled
def draw_fitness_by_evaluations(dataset: xr.Dataset, evaluations: str) -> Figure:
    """Draw mean fitness by generation and by the number of evaluations, averaged over runs."""
    figure = Figure((FIGURE_WIDTH, 2.9))
    by_generation, by_evaluation = figure.subplots(1, 2, sharey=True)
    conditions = style_conditions(dataset)
    averages = _average_runs(dataset, evaluations)
    for condition in conditions:
        runs = averages.sel(condition=condition.name)
        draw_line(by_generation, runs["generation"], runs["mean"], condition.style, condition.name)
        total = runs["evaluations"].where(runs["mean"].notnull())
        draw_line(by_evaluation, total, runs["mean"], condition.style, condition.name)
    use_log_scale(by_evaluation)
    by_generation.set(
        xlabel="generation",
        ylabel=wrap_label(name_outcome_of(fitness.outcome(dataset), "average agent")),
    )
    by_evaluation.set_xlabel("evaluations by all agents of a run until then")
    label_lines(figure, {condition.name: condition.style for condition in conditions})
    return figure


def _average_runs(dataset: xr.Dataset, evaluations: str) -> xr.Dataset:
    """Return `mean` fitness and total `evaluations` (condition, generation), means over runs."""
    per_generation = dataset[evaluations].sum("agent", min_count=1)
    totals = per_generation.cumsum("generation").mean("run")
    return xr.Dataset({"mean": fitness.mean(dataset).mean("run"), "evaluations": totals})


def _tabulate_averages(dataset: xr.Dataset, evaluations: str) -> list[dict[str, Any]]:
    """Return the averages: one row per condition and generation."""
    table = _average_runs(dataset, evaluations).reset_coords(drop=True).to_dataframe()
    return [*table.dropna(subset="mean").reset_index().to_dict("records")]


def draw_survival_figure(report: ReportData) -> ReportFigure:
    return ReportFigure(
        title="Survival of the populations",
        caption=(
            "Share of runs that survive, by time (Kaplan-Meier). A curve that ends above 0 has "
            "runs that still survive at the end of the study."
        ),
        alternative=(
            f"Curves of survival for each condition. {describe_final_medians(report.data, 1)}"
        ),
        figure=draw_survival(report.data),
        table=tabulate_runs(report.data, 1),
    )


@styled
def draw_survival(dataset: xr.Dataset) -> Figure:
    """Draw the fraction of surviving runs by time. The variable `energy` is the survival time."""
    figure = Figure((FIGURE_WIDTH, 3.1))
    axes = figure.subplots()
    lifetimes = fitness.final(dataset, "mean", 1)
    start = max(1.0, 0.9 * float(lifetimes.min()))  # Above 0, for the logarithmic axis.
    conditions = style_conditions(dataset)
    for condition in conditions:
        times = np.sort(lifetimes.sel(condition=condition.name).dropna("run").values)
        n_deaths = np.arange(1, times.size + 1)
        share_alive = 1 - n_deaths / max(1, times.size)
        # Runs with the longest time count as survivors, so no death is drawn.
        share_alive[times == float(lifetimes.max())] = np.nan
        x, y = [start, *times], [1.0, *share_alive]
        draw_line(axes, x, y, condition.style, condition.name, is_stepped=True)
    axes.set(
        ylim=(-0.025, 1.025),
        xlabel=str(dataset["energy"].attrs.get("long_name", "time")),
        ylabel="share of runs that survive",
    )
    use_log_scale(axes)
    label_lines(figure, {condition.name: condition.style for condition in conditions})
    return figure
