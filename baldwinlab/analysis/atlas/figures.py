"""Figures of the atlas: a heat map per pair of axes, residual learning against laws, and grids.

A grid of the page has colored cells with links to their curves. The curves of a cell are inline
SVG. The page draws the first run as an animation.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations, product
from textwrap import fill
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr
from markupsafe import Markup
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.image import AxesImage

from baldwinlab.analysis.atlas.laws import Law
from baldwinlab.analysis.atlas.outcomes import OUTCOMES
from baldwinlab.analysis.atlas.tables import (
    describe_settings,
    estimate_mean,
    format_fall,
    format_label,
    list_cells,
)
from baldwinlab.analysis.figures.charts import (
    CIVIDIS,
    EstimateStyle,
    draw_cells,
    draw_estimates,
    label_cells,
)
from baldwinlab.analysis.figures.curves import make_panels
from baldwinlab.analysis.figures.style import FIGURE_WIDTH, GRAY, styled
from baldwinlab.analysis.palette import BLUE, PALE, choose_text_color
from baldwinlab.analysis.report.tables import Table
from baldwinlab.analysis.results.numbers import format_number
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


# Short names of the outcomes in a cell.
LETTERS: Final = {
    "assimilation": "A",
    "learner_fall": "fall of learners",
    "control_fall": "fall of the control",
    "neutral_fall": "fall without selection",
    "innate_response": "I",
    "selection_ratio": "P",
    "t90": "t90",
    "fork_history": "history",
    "fork_regime": "regime",
}
# Size of a panel of curves, and the margin of the curves, in units of the SVG.
WIDTH: Final = 420
HEIGHT: Final = 130
MARGIN: Final = 6

Floats = npt.NDArray[np.float64]


class ShownOutcome(NamedTuple):
    """The outcome that the cells of a map show, with the range of the colors."""

    name: str
    label: str
    low: float
    high: float

    def format(self, value: float) -> str:
        """Return a value as text, or a dash if it is undefined."""
        return format_fall(value) if self.name == ASSIMILATION else format_number(value)

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


def describe_cells(
    name: str,
    outcomes: xr.Dataset,
    labels: Mapping[str, str],
    values: Sequence[xr.Dataset],
    law: Law | None,
) -> list[dict[str, Any]]:
    """Return the template values of each cell. `values`: variables of `reduce_cell` by cell."""
    measured = law.measured(outcomes).mean("run") if law else None
    predicted = (
        law.predict(outcomes).broadcast_like(measured) if law and measured is not None else None
    )
    shown = choose_outcome(outcomes)
    described = []
    for number, (cell, curves) in enumerate(zip(list_cells(outcomes), values, strict=True)):
        selected = outcomes.sel(cell)
        value = float(selected[shown.name].mean("run"))
        color = _choose_color(shown.scale(value))
        prediction = np.nan if predicted is None else float(predicted.sel(cell))
        described.append(
            {
                "id": f"{name}-{number:04d}",
                "caption": describe_settings(cell, labels),
                "settings": cell,
                "value": shown.format(value),
                "color": color,
                "text_color": choose_text_color(to_rgb(color)),
                "residual": format_number(float(measured.sel(cell)))
                if measured is not None
                else "",
                # A law is derived for some cells only.
                "law": "" if np.isnan(prediction) else format_number(prediction),
                "outcomes": {
                    LETTERS[outcome]: str(estimate_mean(selected[outcome])) for outcome in OUTCOMES
                },
                "panels": [*draw_panels(curves)],
            }
        )
    return described


def _choose_color(share: float) -> str:
    if not np.isfinite(share):
        return PALE
    return to_hex(colormaps[CIVIDIS](np.clip(share, 0, 1)))


def arrange_grids(
    title: str,
    outcomes: xr.Dataset,
    labels: Mapping[str, str],
    cells: Sequence[Mapping[str, Any]],
) -> Iterator[Table]:
    """Yield a grid of the first two axes for each combination of the other axes."""
    rows, columns, *other_axes = outcomes.attrs["fields"]
    letter = LETTERS[choose_outcome(outcomes).name]
    by_settings = {tuple(cell["settings"].items()): _link(cell, letter) for cell in cells}
    column_values = outcomes[columns].values.tolist()
    headings = dict.fromkeys(map(format_label, column_values), "right")
    corner = f"{labels[rows]} \\ {labels[columns]}"
    for fixed in product(*(outcomes[field].values.tolist() for field in other_axes)):
        other_settings = dict(zip(other_axes, fixed, strict=True))
        groups = []
        for row in outcomes[rows].values.tolist():
            # The tuples are equal only if the fields have the order of the settings of a cell.
            keys = [{rows: row, columns: column, **other_settings} for column in column_values]
            links = [by_settings[tuple(settings.items())] for settings in keys]
            groups.append((format_label(row), [links]))
        caption = describe_settings(other_settings, labels)
        label = f"{title} {caption}".rstrip()
        yield Table(label, {corner: "", **headings}, groups, "numbers cells", caption)


def _link(cell: Mapping[str, Any], letter: str) -> Markup:
    """Return the value of a cell, in its color, with a link to its curves."""
    law = Markup("<br><small>{} | {}</small>").format(cell["residual"], cell["law"])
    return Markup(
        '<a href="#{}" style="background:{};color:{}" aria-label="{}: {} = {}">{}{}</a>'
    ).format(
        *(cell[key] for key in ("id", "color", "text_color", "caption")),
        *(letter, cell["value"], cell["value"], law if cell["law"] else ""),
    )


def draw_panels(cell: xr.Dataset) -> Iterator[dict[str, Any]]:
    """Yield the panels of a cell, with curves over the generations and their range."""
    names = {"learned distance": "distance", "innate trait": "innate_trait"}
    if "distance" not in cell or not cell["distance"].notnull().any():
        del names["learned distance"]
    generations = cell["generation"].values.astype(np.float64)
    for title, name in names.items():
        curves = {
            "mean": cell[name].mean("run").values,
            "control": cell[f"control_{name}"].mean("run").values,
            "replay": cell[name].isel(run=0).values,  # The first run.
        }
        stacked = np.concatenate([curve[np.isfinite(curve)] for curve in curves.values()])
        low, high = (float(stacked.min()), float(stacked.max())) if stacked.size else (0.0, 1.0)
        lines = {kind: _project(generations, curve, low, high) for kind, curve in curves.items()}
        yield {"title": title, "low": low, "high": high, "lines": lines}


def _project(generations: Floats, curve: Floats, low: float, high: float) -> str:
    """Return the points of a polyline, for example "6,124 414,6"."""
    # A constant curve has the range 0, and `or 1.0` avoids a division by 0.
    length = generations[-1] - generations[0] or 1.0
    x = MARGIN + (WIDTH - 2 * MARGIN) * (generations - generations[0]) / length
    y = HEIGHT - MARGIN - (HEIGHT - 2 * MARGIN) * (curve - low) / ((high - low) or 1.0)
    return " ".join(
        f"{column:.0f},{row:.0f}" for column, row in zip(x, y, strict=True) if np.isfinite(row)
    )
