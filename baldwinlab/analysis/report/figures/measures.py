"""Measures that models declare: a panel per measure, with a box per condition."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from baldwinlab.analysis.claim_samples import ModelMeasure
from baldwinlab.analysis.figures.charts import BOXES_NOTE, draw_box
from baldwinlab.analysis.figures.curves import draw_legend
from baldwinlab.analysis.figures.style import FIGURE_WIDTH, group_by_map, style_conditions, styled
from baldwinlab.analysis.report.data import ReportData
from baldwinlab.analysis.report.figures import declare_figure
from baldwinlab.analysis.report.sections import ReportFigure
from baldwinlab.analysis.results.numbers import format_number


@declare_figure()
def draw_figure(report: ReportData) -> ReportFigure | None:
    if not report.model_measures:
        return None
    medians = []
    rows = []
    for measure in report.model_measures:
        values = {name: sample for name, sample in measure.values.items() if sample.size}
        texts = [
            f"{name} {format_number(float(np.median(sample)))}" for name, sample in values.items()
        ]
        medians.append(f"{measure.meaning}: {', '.join(texts)}")
        for name, sample in values.items():
            row = {"condition": name, "measure": measure.name}
            rows += [row | {"value": value} for value in sample.tolist()]
    return ReportFigure(
        title="Measures that the claims compare",
        caption=BOXES_NOTE,
        alternative=f"Box plots by condition, with medians over runs: {'; '.join(medians)}.",
        figure=draw_measures(report.data, report.model_measures),
        table=rows,
    )


@styled
def draw_measures(dataset: xr.Dataset, measures: Sequence[ModelMeasure]) -> Figure:
    """Draw one or more measures, each in a panel, with a box per condition and a point per run."""
    conditions = style_conditions(dataset)
    maps = list(group_by_map(dataset))
    learners = list(dict.fromkeys(condition.learner for condition in conditions))
    # A gap of one position separates the maps.
    positions_per_map = len(learners) + 1
    positions = {
        condition.name: maps.index(condition.map_name) * positions_per_map
        + learners.index(condition.learner)
        for condition in conditions
    }
    has_maps = maps != [""]
    # (positions, labels): a tick per learner, or if there are maps, a tick per group of boxes.
    if not has_maps:
        ticks = ([float(position) for position in positions.values()], learners)
    else:
        centers = [
            float(np.mean([positions[condition.name] for condition in group]))
            for group in group_by_map(dataset).values()
        ]
        ticks = (centers, maps)
    figure = Figure((FIGURE_WIDTH, 0.5 + 2.6 * len(measures)))
    panels = figure.subplots(len(measures), squeeze=False).flat
    for axes, measure in zip(panels, measures, strict=True):
        for condition in conditions:
            values = measure.values[condition.name]
            if values.size:
                draw_box(axes, positions[condition.name], values, condition.style)
        title = measure.meaning[0].upper() + measure.meaning[1:]
        axes.set_title(title)
        axes.set_xticks(*ticks)
        axes.set_xlim(-0.8, max(positions.values()) + 0.8)
        axes.grid(visible=False, axis="x")
    if has_maps and len(learners) > 1:
        draw_legend(figure, {item.learner: item.style for item in conditions})
    return figure
