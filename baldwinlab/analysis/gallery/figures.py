"""Forest plot of the gallery: a row per system, a panel per question."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from baldwinlab.analysis.figures.forest import EstimateStyle, draw_estimates
from baldwinlab.analysis.figures.style import BLUE, DARK_GRAY, GRAY, GREEN, PALE, styled
from baldwinlab.analysis.gallery.decisions import Decision, Measurement, SystemName
from baldwinlab.analysis.gallery.summary import DIMENSIONLESS, QuestionSummary
from baldwinlab.analysis.palette import BLACK, VERMILION
from baldwinlab.analysis.results.verdicts import EQUIVALENT, OPPOSITE, UNDECIDED, YES
from baldwinlab.analysis.statistics.meta_analysis import RandomEffects

# Widths of the names of systems and of a panel, in inches.
NAMES_WIDTH: Final = 2.4
PANEL_WIDTH: Final = 1.6
# Heights of a row, and of the titles, the ticks and the legend together, in inches.
ROW_HEIGHT: Final = 0.2
AXES_HEIGHT: Final = 1.7
VERDICT_STYLES: Final[Mapping[str, EstimateStyle]] = {
    YES: EstimateStyle(BLUE, size=5, width=1.4),
    OPPOSITE: EstimateStyle(VERMILION, "X", size=5, width=1.4),
    EQUIVALENT: EstimateStyle(GREEN, "s", size=5, width=1.4),
    UNDECIDED: EstimateStyle(GRAY, face="white", size=5, width=1.4),
}
MEAN_STYLE: Final = EstimateStyle(BLACK, "D", "white", size=6, width=2.4)
MEAN_LABEL: Final = "mean of papers"


@styled
def draw_forest(systems: Sequence[SystemName], summaries: Sequence[QuestionSummary]) -> Figure:
    """Draw the effect sizes of all systems with their 95 % intervals.

    The figure has one row per system, and a last row with the mean of the papers.
    """
    rows, headings = _place_rows(systems)
    mean_row = max(rows.values()) + 1.5
    figure = Figure(
        (NAMES_WIDTH + PANEL_WIDTH * len(summaries), AXES_HEIGHT + ROW_HEIGHT * mean_row)
    )
    panels = figure.subplots(1, len(summaries), sharey=True, squeeze=False)[0]
    for axes, summary in zip(panels, summaries, strict=True):
        axes.set_title(summary.question, loc="left", fontweight="bold")
        axes.set_xlabel("" if summary.unit == DIMENSIONLESS else summary.unit)
        axes.axvline(0, color=DARK_GRAY, lw=0.8)
        for decision, measurement in summary.measurements:
            _draw_measurement(axes, rows[decision.system], decision, measurement, summary)
        if summary.mean:
            _draw_mean(axes, mean_row, summary.mean)
    ticks = [*rows.values(), mean_row]
    panels[0].set_yticks(ticks, [*(system.condition for system in rows), MEAN_LABEL])
    for paper, row in headings.items():
        _draw_heading(panels[0], paper, row)
    panels[0].set_ylim(mean_row + 0.8, -0.8)
    figure.legend(handles=_make_legend_handles(), loc="outside lower center", ncols=3)
    return figure


def _place_rows(systems: Sequence[SystemName]) -> tuple[dict[SystemName, int], dict[str, int]]:
    """Return the row of each system, and of each paper's name above its systems."""
    rows: dict[SystemName, int] = {}
    headings: dict[str, int] = {}
    for system in systems:
        if system.paper not in headings:
            headings[system.paper] = len(rows) + len(headings)
        rows[system] = len(rows) + len(headings)
    return rows, headings


def _draw_heading(axes: Axes, paper: str, row: int) -> None:
    axes.annotate(
        paper,
        (0, row),
        (-4, 0),
        xycoords=("axes fraction", "data"),
        textcoords="offset points",
        ha="right",
        va="center",
        fontweight="bold",
        annotation_clip=False,
    )


def _draw_measurement(
    axes: Axes, row: int, decision: Decision, measurement: Measurement, summary: QuestionSummary
) -> None:
    """Draw a system: its equivalence bounds, its interval and its effect."""
    scale = summary.scale(decision)
    bound = scale * decision.estimate.equivalence_bound
    axes.barh(row, 2 * bound, left=-bound, height=0.9, color=PALE, zorder=0.5)
    numbers = [scale * value for value in (measurement.effect, measurement.low, measurement.high)]
    draw_estimates(axes, row, numbers, VERDICT_STYLES[measurement.verdict], is_horizontal=True)


def _draw_mean(axes: Axes, row: float, mean: RandomEffects) -> None:
    """Draw the mean of the papers: prediction interval, interval and mean."""
    prediction = [mean.prediction_low, mean.prediction_high]
    axes.plot(prediction, [row, row], color=BLACK, lw=0.8)
    numbers = (mean.mean, mean.low, mean.high)
    draw_estimates(axes, row, numbers, MEAN_STYLE, is_horizontal=True)


def _make_legend_handles() -> list[Line2D | Patch]:
    mean = f"{MEAN_LABEL}: 95 % interval, prediction interval"
    styles: dict[str, EstimateStyle] = {**VERDICT_STYLES, mean: MEAN_STYLE}
    lines = [Line2D([], [], **style.marks, label=label) for label, style in styles.items()]
    return [*lines, Patch(color=PALE, label="within the equivalence bound")]
