"""Fitness by generations and by evaluations. Learning uses many evaluations per generation."""

from __future__ import annotations

from typing import Any

import xarray as xr
from matplotlib.figure import Figure

from baldwinlab.analysis.figures.curves import draw_line, use_log_scale
from baldwinlab.analysis.figures.line_labels import label_lines
from baldwinlab.analysis.figures.style import FIGURE_WIDTH, style_conditions, styled, wrap_label
from baldwinlab.analysis.report.content import (
    describe_final_medians,
    find_evaluation_variable,
    name_fitness,
)
from baldwinlab.analysis.report.data import ReportData
from baldwinlab.analysis.report.figures import declare_figure
from baldwinlab.analysis.report.sections import ReportFigure
from baldwinlab.analysis.statistics import fitness
from baldwinlab.experiment.outcome import name_outcome_of


@declare_figure()
def draw_figure(report: ReportData) -> ReportFigure | None:
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
        table=_tabulate(report.data, evaluation_variable),
    )


@styled
def draw_fitness_by_evaluations(dataset: xr.Dataset, evaluations: str) -> Figure:
    """Draw mean fitness by generation and by the number of evaluations, averaged over runs."""
    figure = Figure((FIGURE_WIDTH, 2.9))
    by_generation, by_evaluation = figure.subplots(1, 2, sharey=True)
    conditions = style_conditions(dataset)
    averages = _average(dataset, evaluations)
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


def _average(dataset: xr.Dataset, evaluations: str) -> xr.Dataset:
    """Return `mean` fitness and total `evaluations` (condition, generation), means over runs."""
    per_generation = dataset[evaluations].sum("agent", min_count=1)
    totals = per_generation.cumsum("generation").mean("run")
    return xr.Dataset({"mean": fitness.mean(dataset).mean("run"), "evaluations": totals})


def _tabulate(dataset: xr.Dataset, evaluations: str) -> list[dict[str, Any]]:
    """Return the averages: one row per condition and generation."""
    table = _average(dataset, evaluations).reset_coords(drop=True).to_dataframe()
    return [*table.dropna(subset="mean").reset_index().to_dict("records")]
