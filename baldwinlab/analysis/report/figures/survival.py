"""Survival of the populations, for models whose fitness is a survival time."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from baldwinlab.analysis.figures.curves import draw_line, use_log_scale
from baldwinlab.analysis.figures.line_labels import label_lines
from baldwinlab.analysis.figures.style import FIGURE_WIDTH, style_conditions, styled
from baldwinlab.analysis.report.content import describe_final_medians, tabulate_runs
from baldwinlab.analysis.report.data import ReportData
from baldwinlab.analysis.report.figures import declare_figure
from baldwinlab.analysis.report.sections import ReportFigure
from baldwinlab.analysis.statistics import fitness


@declare_figure()
def draw_figure(report: ReportData) -> ReportFigure:
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
