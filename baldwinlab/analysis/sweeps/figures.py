"""Figures of the response of fitness to fields of a sweep: curves, and heat maps of two fields."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from typing import Final

import numpy as np
import numpy.typing as npt
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from baldwinlab.analysis.figures.charts import EstimateStyle, draw_cells, draw_estimates
from baldwinlab.analysis.figures.curves import find_top, use_log_scale
from baldwinlab.analysis.figures.style import BLUE, FIGURE_WIDTH, GRAY, styled, wrap_label
from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.sweeps import analysis
from baldwinlab.analysis.sweeps.analysis import Group

MEASURE_TITLES: Final = {"best": "Best agent", "mean": "Average agent", "share": "Share that eats"}
MAX_TICKS: Final = 8
# Smallest ratio of the largest to the smallest value on a log scale.
MIN_LOG_RANGE: Final = 10
# Largest numbers of characters in a line: the label of a panel, and the label of a wider axis.
LINE_LENGTH: Final = 26
LONG_LINE_LENGTH: Final = 60
# Largest number of horizontal labels of a field of texts.
MAX_HORIZONTAL_LABELS: Final = 3
# Largest numbers of columns and rows of a heat map with numbers in its cells.
MAX_NUMBERED_COLUMNS: Final = 5
MAX_NUMBERED_ROWS: Final = 8
# Heights in inches: a row, a heat map, and the title, color bar and labels of a heat map.
ROW_HEIGHT: Final = 0.32
MIN_MAP_HEIGHT: Final = 0.9
MAX_MAP_HEIGHT: Final = 3.2
LABELS_HEIGHT: Final = 1.5
# Top of the color bar if all values are 0, so that its range is not empty.
MIN_TOP: Final = 1e-9


def choose_axis_scale(values: Sequence[float] | npt.NDArray[np.float64]) -> str:
    """Return the scale of an axis: "log", "symlog" or "linear".

    "log" needs positive values that span a factor of ten or more, and that are spaced more evenly
    on a log scale than on a linear scale. If 0 is also a value, the scale is "symlog".
    """
    numbers = np.unique(np.asarray(values, np.float64))
    positive = numbers[numbers > 0]
    has_negative = numbers.size > 0 and numbers[0] < 0
    # Two values have a single distance, so only three or more can be spaced unevenly.
    if has_negative or positive.size < 2 or positive[-1] < MIN_LOG_RANGE * positive[0]:
        return "linear"
    if positive.size > 2 and _measure_unevenness(np.log(positive)) >= _measure_unevenness(positive):
        return "linear"
    return "log" if positive.size == numbers.size else "symlog"


def _measure_unevenness(numbers: npt.NDArray[np.float64]) -> float:
    """Return the standard deviation of the distances between neighbors, divided by the mean."""
    steps = np.diff(numbers)
    return float(steps.std() / steps.mean())


@styled
def draw_response_curves(finals: xr.Dataset) -> Figure:
    """Draw the mean of each measure by the value of each field, with its 95 % interval.

    The figure has a row per field and a column per measure. A sample also has a dot per point.
    """
    fields = finals.attrs["fields"]
    figure = Figure((FIGURE_WIDTH, 0.3 + 2.2 * len(fields)))
    grid = figure.subplots(len(fields), len(MEASURE_TITLES), squeeze=False, sharey="col")
    for row, field in zip(grid, fields, strict=True):
        for axes, measure in zip(row, MEASURE_TITLES, strict=True):
            _draw_responses(axes, finals, field, measure)
        row[0].set_xlabel(
            textwrap.fill(describe_field(finals, field), LONG_LINE_LENGTH), loc="left"
        )
        row[0].set_ylabel(wrap_label(fitness.outcome(finals)))
    for axes, (measure, title) in zip(grid[0], MEASURE_TITLES.items(), strict=True):
        axes.set_title(title)
        top = 1.0 if measure == "share" else find_top(axes)
        axes.set_ylim(-0.025 * top, 1.025 * top)
    return figure


def describe_field(finals: xr.Dataset, field: str) -> str:
    """Return the description of a field, or its path if it has none."""
    return str(finals[field].attrs.get("long_name") or field)


def _draw_responses(axes: Axes, finals: xr.Dataset, field: str, measure: str) -> None:
    responses = analysis.compute_responses(finals, field, measure)
    has_numbers = analysis.is_number(finals[field])
    if analysis.is_sampled(finals):
        positions = finals[field].values
        if not has_numbers:
            positions = _locate_points(analysis.group_points(finals, field))
        means = finals[measure].mean("run")
        axes.plot(positions, means, "o", color=GRAY, ms=3, alpha=0.45, mew=0, clip_on=False)
    centers = [response.position for response in responses]
    estimates = np.array([response[-3:] for response in responses]).T  # Mean, low and high.
    draw_estimates(axes, centers, estimates, EstimateStyle(BLUE), is_joined=has_numbers)
    if has_numbers:
        _scale_axis(axes, finals[field].values)
    else:
        labels = [response.group for response in responses]
        rotation = 0 if len(labels) <= MAX_HORIZONTAL_LABELS else 30
        axes.set_xticks(range(len(labels)), labels, rotation=rotation)
        axes.set_xlim(-0.5, len(labels) - 0.5)


def _scale_axis(axes: Axes, values: npt.NDArray[np.float64]) -> None:
    scale = choose_axis_scale(values)
    if scale == "symlog":
        use_log_scale(axes, float(values[values > 0].min()))
    elif scale == "log":
        use_log_scale(axes)
    elif np.issubdtype(values.dtype, np.integer):
        axes.xaxis.set_major_locator(MaxNLocator(integer=True, steps=[1, 2, 5, 10], min_n_ticks=1))


def _locate_points(groups: Sequence[Group]) -> npt.NDArray[np.float64]:
    """Return the position of each point on an axis of texts."""
    positions = np.empty(sum(len(group.points) for group in groups))
    for group in groups:
        positions[group.points] = group.position
    return positions


@styled
def draw_heat_maps(finals: xr.Dataset, row: str, column: str) -> Figure:
    """Draw means over runs and all other fields by the values of two fields of a grid."""
    rows = analysis.group_points(finals, row)
    columns = analysis.group_points(finals, column)
    map_height = min(max(ROW_HEIGHT * len(rows), MIN_MAP_HEIGHT), MAX_MAP_HEIGHT)
    figure = Figure((FIGURE_WIDTH, LABELS_HEIGHT + map_height))
    grid = figure.subplots(1, len(MEASURE_TITLES), squeeze=False, sharey=True)[0]
    for axes, (measure, title) in zip(grid, MEASURE_TITLES.items(), strict=True):
        values = analysis.compute_table(finals, row, column, measure)
        is_share = measure == "share"
        top = 1.0 if is_share else max(float(np.nanmax(values, initial=0.0)), MIN_TOP)
        image = draw_cells(axes, values, _format_cells(values), limits=(0, top), is_upward=True)
        label = "share of agents" if is_share else fitness.outcome(finals)
        figure.colorbar(image, ax=axes, location="top", label=label, aspect=30)
        axes.set_title(title)
        _label_values(axes, rows, columns)
    grid[0].set_ylabel(textwrap.fill(describe_field(finals, row), LINE_LENGTH))
    grid[1].set_xlabel(textwrap.fill(describe_field(finals, column), LONG_LINE_LENGTH))
    return figure


def _label_values(axes: Axes, rows: Sequence[Group], columns: Sequence[Group]) -> None:
    for axis, groups in ((axes.xaxis, columns), (axes.yaxis, rows)):
        stride = math.ceil(len(groups) / MAX_TICKS)
        tick_labels = [group.label for group in groups[::stride]]
        axis.set_ticks(range(0, len(groups), stride), tick_labels)
    n_letters = max(len(group.label) for group in columns)
    if n_letters * len(columns) > LINE_LENGTH:
        axes.tick_params(axis="x", rotation=90)


def _format_cells(values: npt.NDArray[np.float64]) -> npt.NDArray[np.str_]:
    """Return the number of each cell of a small map, else empty texts."""
    n_rows, n_columns = values.shape
    if n_columns > MAX_NUMBERED_COLUMNS or n_rows > MAX_NUMBERED_ROWS:
        return np.full(values.shape, "")
    return np.array([[_format_cell(value) for value in row] for row in values])


def _format_cell(value: float) -> str:
    if not np.isfinite(value):
        return ""
    return f"{value:.3g}" if value < 1000 else f"{value:,.0f}"
