"""How fitness responds to the fields of a sweep: a curve for each field, and a heat map for each pair of fields of a grid.

The colours of heat maps are those of cividis, which look alike with every kind of colour vision: J. R. Nuñez, C. R. Anderton
and R. S. Renslow, PLOS ONE 13 (2018).
"""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, NullLocator

from baldwinlab.analysis.figures.style import BLACK, BLUE, GRAY, WIDTH, styled
from baldwinlab.analysis.sweeps import analysis
from baldwinlab.analysis.sweeps.analysis import Group, Response

COLUMNS = {"best": "Best agent", "mean": "Average agent", "share": "Share that ate"}
MOST_TICKS = 8
LONG = 26  # characters of an axis label in a line


def axis_scale(values: Sequence[float] | npt.NDArray[np.float64]) -> str:
    """`log` where numbers span a factor of ten and lie more evenly on a log scale; `symlog` where 0 is besides; else `linear`."""
    numbers = np.unique(np.asarray(values, np.float64))
    positive = numbers[numbers > 0]
    if numbers.size == 0 or numbers[0] < 0 or positive.size < 2 or positive[-1] < 10 * positive[0]:
        return "linear"
    if positive.size > 2 and _unevenness(np.log(positive)) >= _unevenness(positive):
        return "linear"
    return "log" if positive.size == numbers.size else "symlog"


def _unevenness(numbers: npt.NDArray[np.float64]) -> float:
    steps = np.diff(numbers)
    return float(steps.std() / steps.mean())


@styled
def response_curves(measured: xr.Dataset) -> Figure:
    """A row for each field, a column for each measure; `measured` is that of `analysis.finals`.

    The mean over all other fields, with its 95 % interval as bars; of a random or a Sobol sample, also a dot for each point.
    """
    fields = measured.attrs["fields"]
    figure = Figure((WIDTH, 0.3 + 2.2 * len(fields)))
    grid = figure.subplots(len(fields), len(COLUMNS), squeeze=False, sharey="col")
    for row, field in zip(grid, fields, strict=True):
        for axes, measure in zip(row, COLUMNS, strict=True):
            _curve(axes, measured, field, measure)
        row[0].set_xlabel(textwrap.fill(meaning(measured, field), 60), loc="left")
    for axes, (measure, title) in zip(grid[0], COLUMNS.items(), strict=True):
        axes.set_title(title, loc="left", fontweight="bold")
        top = (
            1.0 if measure == "share" else axes.get_ylim()[1] if axes.dataLim.y1 > 0 else 1.0
        )  # where nobody ate
        axes.set_ylim(-0.025 * top, 1.025 * top)
    for row in grid:
        row[0].set_ylabel(_unit(measured))
    return figure


def _unit(measured: xr.Dataset) -> str:
    return "fitness (energy)" if measured.attrs["food"] else "fitness"


def meaning(measured: xr.Dataset, field: str) -> str:
    """What a field is, in words; its path where nothing else is known."""
    return str(measured[field].attrs.get("long_name") or field)


def _curve(axes: Axes, measured: xr.Dataset, field: str, measure: str) -> None:
    found = analysis.responses(measured, field, measure)
    numbers = analysis.is_number(measured[field])
    if analysis.is_sampled(measured):
        places = (
            measured[field].values
            if numbers
            else _numbered(found, analysis.groups(measured, field))
        )
        axes.plot(
            places,
            measured[measure].mean("run"),
            "o",
            color=GRAY,
            ms=3,
            alpha=0.45,
            mew=0,
            clip_on=False,
        )
    _line(axes, found, joined=numbers)
    if not numbers:
        axes.set_xticks(
            range(len(found)),
            [response.group for response in found],
            rotation=0 if len(found) < 4 else 30,
        )
        axes.set_xlim(-0.5, len(found) - 0.5)
        return
    scale = axis_scale(measured[field].values)
    if scale == "symlog":
        positive = measured[field].values[measured[field].values > 0]
        axes.set_xscale("symlog", linthresh=float(positive.min()))
    elif scale == "log":
        axes.set_xscale("log")
    elif np.issubdtype(measured[field].dtype, np.integer):
        axes.xaxis.set_major_locator(MaxNLocator(integer=True, steps=[1, 2, 5, 10], min_n_ticks=1))
    if scale != "linear":
        axes.xaxis.set_minor_locator(NullLocator())


def _numbered(found: Sequence[Response], groups: Sequence[Group]) -> npt.NDArray[np.float64]:
    """For each point, the number of its text."""
    places = np.empty(sum(len(group.points) for group in groups))
    for group in groups:
        places[group.points] = group.position
    return places


def _line(axes: Axes, found: Sequence[Response], joined: bool) -> None:
    place = [response.position for response in found]
    mean, low, high = (
        np.array([getattr(response, name) for response in found])
        for name in ("mean", "low", "high")
    )
    axes.plot(
        place,
        mean,
        ls="-" if joined else "none",
        color=BLUE,
        lw=1.5,
        marker="o",
        ms=4,
        clip_on=False,
    )
    axes.vlines(place, low, high, color=BLUE, lw=1.1)


@styled
def heat_maps(measured: xr.Dataset, row: str, column: str) -> Figure:
    """A map for each measure: the mean over runs and all other fields, by the values of two fields of a grid."""
    down, across = analysis.groups(measured, row), analysis.groups(measured, column)
    figure = Figure((WIDTH, 1.5 + min(max(0.32 * len(down), 0.9), 3.2)))
    grid = figure.subplots(1, len(COLUMNS), squeeze=False, sharey=True)[0]
    for axes, (measure, title) in zip(grid, COLUMNS.items(), strict=True):
        values = analysis.table(measured, row, column, measure)
        top = 1.0 if measure == "share" else max(float(np.nanmax(values, initial=0.0)), 1e-9)
        drawn = axes.imshow(values, cmap="cividis", vmin=0, vmax=top, origin="lower", aspect="auto")
        figure.colorbar(
            drawn,
            ax=axes,
            location="top",
            label=_unit(measured) if measure != "share" else "share of agents",
            aspect=30,
        )
        axes.set_title(title, loc="left", fontweight="bold")
        axes.grid(visible=False)
        _name_values(axes, down, across)
        _write_values(axes, values, top)
    grid[0].set_ylabel(textwrap.fill(meaning(measured, row), LONG))
    grid[1].set_xlabel(textwrap.fill(meaning(measured, column), 60))
    return figure


def _name_values(axes: Axes, down: Sequence[Group], across: Sequence[Group]) -> None:
    for axis, groups in ((axes.xaxis, across), (axes.yaxis, down)):
        every = -(-len(groups) // MOST_TICKS)
        axis.set_ticks(range(0, len(groups), every), [group.label for group in groups[::every]])
    longest = max(len(group.label) for group in across)
    if longest * len(across) > LONG:
        axes.tick_params(axis="x", rotation=90)


def _write_values(axes: Axes, values: npt.NDArray[np.float64], top: float) -> None:
    """The number in each cell, where there is room."""
    rows, columns = values.shape
    if columns > 5 or rows > 8:
        return
    for (row, column), value in np.ndenumerate(values):
        if np.isfinite(value):
            colour = BLACK if value > 0.55 * top else "white"
            axes.text(
                column,
                row,
                f"{value:.3g}" if value < 1000 else f"{value:,.0f}",
                ha="center",
                va="center",
                color=colour,
            )
