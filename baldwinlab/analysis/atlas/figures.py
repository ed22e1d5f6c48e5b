"""Figures of the atlas: a heat map per pair of axes, and residual learning against the laws."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from textwrap import fill
from typing import Any, Final, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage

from baldwinlab.analysis.atlas.laws import Law
from baldwinlab.analysis.atlas.tables import format_fall, format_label
from baldwinlab.analysis.figures.charts import (
    EstimateStyle,
    draw_cells,
    draw_estimates,
    label_cells,
)
from baldwinlab.analysis.figures.curves import make_panels
from baldwinlab.analysis.figures.style import FIGURE_WIDTH, GRAY, styled
from baldwinlab.analysis.palette import BLUE
from baldwinlab.analysis.typeface import TEXT_SIZE

ASSIMILATION: Final = "assimilation"
LAW_STYLE: Final = EstimateStyle(BLUE, size=3, width=0.8)
PANEL_WIDTH: Final = 3.4
PANEL_HEIGHT: Final = 2.7
MAX_LABEL: Final = 44
# Figure of the laws: number of panels in a row, and height of a row in inches.
LAW_COLUMNS: Final = 4
LAW_HEIGHT: Final = 2.4
# Largest number of characters in a line of a panel's title.
LAW_TITLE_WIDTH: Final = 21


class ShownOutcome(NamedTuple):
    """The outcome that the cells of a map show, with the range of the colors."""

    name: str
    label: str
    low: float
    high: float

    def format(self, value: float) -> str:
        """Return a value as text, or a dash if it is undefined."""
        return format_fall(value) if self.name == ASSIMILATION else format_cell(value)

    def scale(self, value: float) -> float:
        """Return the position of a value, which may be NaN, in the range of the colors."""
        return (value - self.low) / (self.high - self.low)


class LawPoints(NamedTuple):
    """Measured and predicted residual learning in the cells of a map."""

    title: str
    quantity: str
    rows: Sequence[Mapping[str, Any]]  # Rows of `tables.tabulate` with a prediction.


@styled
def draw_maps(outcomes: xr.Dataset, axes_labels: Mapping[str, str], law: Law | None) -> Figure:
    """Draw the assimilation A for each pair of axes of a map, or the innate response I without A.

    A panel has the means over the runs and the other axes. `axes_labels`: label of each field.
    """
    outcome = choose_outcome(outcomes)
    values = outcomes[outcome.name].mean("run")
    prediction = law.predict(outcomes) if law else None
    pairs = list(combinations(axes_labels, 2))
    figure = Figure((max(FIGURE_WIDTH / 2, PANEL_WIDTH * len(pairs)), PANEL_HEIGHT))
    panels = figure.subplots(1, len(pairs), squeeze=False)[0]
    for axes, (row, column) in zip(panels, pairs, strict=True):
        other_axes = [dim for dim in values.dims if dim not in (row, column)]
        image = _draw_cells(axes, values.mean(other_axes).transpose(row, column), outcome)
        if prediction is not None and {row, column} & set(prediction.dims):
            averaged = prediction.mean([dim for dim in other_axes if dim in prediction.dims])
            _draw_contours(
                axes, averaged.broadcast_like(values.mean(other_axes)).transpose(row, column)
            )
        axes.set(xlabel=_shorten(axes_labels[column]), ylabel=_shorten(axes_labels[row]))
    figure.colorbar(image, ax=list(panels), label=outcome.label, shrink=0.9)  # For all panels.
    return figure


def choose_outcome(outcomes: xr.Dataset) -> ShownOutcome:
    """Return the outcome that the cells of a map show: A, or I if all values of A are NaN."""
    name, label = ASSIMILATION, "assimilation A"
    if not bool(outcomes[name].notnull().any()):
        name, label = "innate_response", "innate response I"
    largest = float(np.abs(outcomes[name].mean("run")).max())
    return ShownOutcome(name, label, -largest, largest)


def _shorten(label: str) -> str:
    return label if len(label) <= MAX_LABEL else f"{label[: MAX_LABEL - 1]}…"


def _draw_cells(axes: Axes, cells: xr.DataArray, outcome: ShownOutcome) -> AxesImage:
    texts = np.vectorize(outcome.format)(cells.values)
    limits = (outcome.low, outcome.high)
    image = draw_cells(axes, cells.values, texts, limits=limits, is_upward=True)
    rows, columns = (map(format_label, cells[dim].values.tolist()) for dim in cells.dims)
    label_cells(axes, list(rows), list(columns))
    return image


def format_cell(value: float) -> str:
    """Return the outcome of a cell, or a dash if it is undefined."""
    return f"{value:.2f}" if np.isfinite(value) else "–"


def _draw_contours(axes: Axes, prediction: xr.DataArray) -> None:
    """Draw contours of the law, if it varies and the grid is large enough."""
    values = prediction.values
    defined = values[np.isfinite(values)]
    if min(values.shape) < 2 or defined.size < 2 or np.ptp(defined) == 0:
        return
    lines = axes.contour(values, levels=4, colors="white", linewidths=1.2)
    axes.clabel(lines, fontsize=TEXT_SIZE, fmt="%.2g")


@styled
def draw_laws(points: Sequence[LawPoints]) -> Figure:
    """Draw measured residual learning against the law, with the line of equality."""
    figure, panels = make_panels(len(points), LAW_COLUMNS, LAW_HEIGHT, 0)  # Without a legend.
    for axes, group in zip(panels.flat, points, strict=False):
        _draw_law(axes, group)
    return figure


def _draw_law(axes: Axes, group: LawPoints) -> None:
    # A cell of a single run has no interval, and None becomes NaN.
    columns = ("law", "mean", "low", "high")
    values = np.array([[row[column] for row in group.rows] for column in columns], np.float64)
    top = 1.08 * np.nanmax(values)
    axes.plot([0, top], [0, top], color=GRAY, lw=1)
    draw_estimates(axes, values[0], values[1:], LAW_STYLE)
    limits = (-0.04 * top, top)
    axes.set(xlim=limits, ylim=limits, aspect="equal")
    axes.locator_params(nbins=3)
    # Each panel has labels, because a narrow page shows the panels below each other.
    axes.set_xlabel("law")
    axes.set_ylabel("measured")
    lines = [fill(f"{group.title}:", LAW_TITLE_WIDTH), fill(group.quantity, LAW_TITLE_WIDTH)]
    axes.set_title("\n".join(lines))
