"""Panels of the figures of assays: grids, curves, axes and legends, and the data of figures."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from baldwinlab.analysis.assays.values import Stored, read_factors
from baldwinlab.analysis.figures.style import (
    FIGURE_WIDTH,
    LINE_STYLES,
    MARKERS,
    SeriesStyle,
    choose_style,
)
from baldwinlab.analysis.palette import NEWBORN_COLORS
from baldwinlab.analysis.statistics.curve_intervals import interval_of_median

# From the first to the last generation of newborns.
NEWBORN_STYLES: Final = [
    SeriesStyle(color, line, marker)
    for color, line, marker in zip(NEWBORN_COLORS, LINE_STYLES[::-1], MARKERS, strict=False)
]
# Largest number of markers on a curve.
MAX_MARKERS: Final = 8


def make_grid(
    data: Stored, names: Sequence[str], rows: int, height: float
) -> tuple[Figure, np.ndarray]:
    """Return a figure and its panels (condition, row), with two conditions next to each other.

    `height` is the height of a row, in inches.
    """
    n_columns = min(len(names), 2)
    # A block has all rows of the conditions that are next to each other.
    n_blocks = math.ceil(len(names) / n_columns)
    figure = Figure((FIGURE_WIDTH, 0.6 + height * rows * n_blocks))
    grid = figure.subplots(n_blocks * rows, n_columns, squeeze=False)
    # From [block and row, column] to [condition, row].
    panels = grid.reshape(n_blocks, rows, n_columns).transpose(0, 2, 1).reshape(-1, rows)
    # An odd number of conditions leaves the last panels unused.
    for axes in panels[len(names) :].flat:
        axes.set_visible(False)
    top_panels = panels[:, 0]
    for axes, name in zip(top_panels, names, strict=False):
        axes.set_title(read_factors(data[name]).title, loc="left", fontweight="bold")
    return figure, panels[: len(names)]


def draw_curve(
    axes: Axes, values: xr.DataArray, style: SeriesStyle, label: str, dim: str = "generation"
) -> None:
    """Draw the median over runs with its 95 % interval, or nothing if all values are NaN."""
    defined = values.dropna(dim, how="all")
    if not defined.size:
        return
    median, low, high = interval_of_median(defined)
    positions = defined[dim].values
    axes.fill_between(positions, low, high, color=style.color, alpha=0.18, lw=0)
    axes.plot(
        positions,
        median,
        color=style.color,
        ls=style.line,
        lw=1.5,
        marker=style.marker,
        ms=3.5,
        markevery=max(1, defined.sizes[dim] // MAX_MARKERS),
        label=label,
    )


def tabulate_median(values: xr.DataArray) -> list[dict[str, Any]]:
    """Return the data of a figure: the median over runs with its interval, by the coordinates."""
    interval = interval_of_median(values)
    numbers = {"median": interval.center, "low": interval.low, "high": interval.high}
    return [*xr.Dataset(numbers).to_dataframe().reset_index().to_dict("records")]


def start_at_zero(axes: Axes) -> None:
    """Let the vertical axis start slightly below 0."""
    top = axes.get_ylim()[1] if axes.dataLim.y1 > 0 else 1.0
    axes.set_ylim(-0.025 * top, top)


def label_rows(grid: np.ndarray, *labels: str) -> None:
    """Label the rows at the left edge."""
    # Two conditions are next to each other, so every second one is in the left column.
    left_panels = grid[::2]
    for panels in left_panels:
        for axes, label in zip(panels, labels, strict=True):
            axes.set_ylabel(label)


def list_handles(panels: Sequence[Axes] | np.ndarray) -> list[Artist]:
    """Return one legend handle per label."""
    handles: dict[str, Artist] = {}
    for axes in panels:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    return list(handles.values())


def draw_legend(figure: Figure, styles: Mapping[str, SeriesStyle], stored: Stored) -> None:
    """Draw a legend of the learners of some conditions."""
    learners = {read_factors(data).learner for data in stored.values()}
    handles = [
        figure.axes[0].plot(
            [], [], color=style.color, ls=style.line, marker=style.marker, ms=4, label=learner
        )[0]
        for learner, style in styles.items()
        if learner in learners
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=4)


def style_learners(stored: Stored) -> dict[str, SeriesStyle]:
    """Return the style of each learner, which is the same in all figures of the study."""
    learners = [name for data in stored.values() for name in data.attrs.get("learners", ())]
    learners += [read_factors(data).learner for data in stored.values()]
    return {
        name: choose_style(learner_index)
        for learner_index, name in enumerate(dict.fromkeys(learners))
    }
