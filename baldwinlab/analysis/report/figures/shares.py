"""Fractions by generation, of each allele or of each species: a panel per condition."""

from __future__ import annotations

import math

import xarray as xr
from matplotlib.figure import Figure

from baldwinlab.analysis.figures.curves import draw_curve, make_panels
from baldwinlab.analysis.figures.line_labels import label_lines
from baldwinlab.analysis.figures.style import (
    choose_style,
    label_generations,
    style_conditions,
    styled,
)
from baldwinlab.analysis.report.content import (
    compute_shares,
    compute_species_composition,
    tabulate_shares,
)
from baldwinlab.analysis.report.data import ReportData
from baldwinlab.analysis.report.sections import ReportFigure
from baldwinlab.analysis.statistics.intervals import interval_of_mean

# Largest number of panels in a row.
MAX_COLUMNS = 3
# Heights of a panel and of the legend, in inches.
PANEL_HEIGHT = 2.2
LEGEND_HEIGHT = 0.5


def draw_figure(report: ReportData) -> ReportFigure | None:
    shares = compute_shares(report.data, report.experiments)
    if not shares:
        return None
    meanings = "; ".join(f"{name}: {share.attrs['long_name']}" for name, share in shares.items())
    return ReportFigure(
        title="Composition of the generations",
        caption=(
            "Lines are means over agents and runs. Bands are 95 % intervals of the mean over runs "
            f"(Student's t). {meanings}."
        ),
        alternative=f"Curves by generation for each condition: {meanings}.",
        figure=draw_shares(shares),
        table=tabulate_shares(shares),
    )


def draw_species_figure(report: ReportData) -> ReportFigure | None:
    shares = compute_species_composition(report.data, report.experiments)
    if not shares:
        return None
    names = ", ".join(map(str, shares))
    return ReportFigure(
        title="Shares of the species",
        caption=(
            "Share of each species in the agents of a generation, in the conditions in which the "
            "species compete. Lines are means over runs. Bands are 95 % intervals of the mean "
            "(Student's t). A run that stopped keeps its last value."
        ),
        alternative=f"Curves by generation for each condition: shares of {names}.",
        figure=draw_shares(shares),
        table=[row for row in tabulate_shares(shares) if not math.isnan(row["mean"])],
    )


@styled
def draw_shares(shares: xr.Dataset) -> Figure:
    """Draw fractions (condition, run, generation): the mean over runs and its 95 % interval."""
    conditions = style_conditions(shares)
    figure, panels = make_panels(
        len(conditions), MAX_COLUMNS, PANEL_HEIGHT, LEGEND_HEIGHT, sharey=True
    )
    styles = {str(name): choose_style(index) for index, name in enumerate(shares)}
    for axes, condition in zip(panels.flat, conditions, strict=False):
        axes.set_title(condition.name)
        for name, style in styles.items():
            interval = interval_of_mean(shares[name].sel(condition=condition.name))
            draw_curve(axes, interval, style, name)
        axes.set_ylim(-0.025, 1.025)
        label_generations(axes)
    for row in panels:
        row[0].set_ylabel("share")
    label_lines(figure, styles)
    return figure
