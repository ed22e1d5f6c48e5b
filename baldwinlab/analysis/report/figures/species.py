"""Fraction of each competing species in the population, by generation."""

from __future__ import annotations

import math

from baldwinlab.analysis.report.content import compute_species_composition, tabulate_shares
from baldwinlab.analysis.report.data import ReportData
from baldwinlab.analysis.report.figures import declare_figure
from baldwinlab.analysis.report.figures.shares import draw_shares
from baldwinlab.analysis.report.sections import ReportFigure


@declare_figure()
def draw_figure(report: ReportData) -> ReportFigure | None:
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
