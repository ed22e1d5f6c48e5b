"""Figure of the meals within a lifetime."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from baldwinlab.analysis.assays.panels import (
    draw_curve,
    label_rows,
    list_handles,
    make_grid,
    start_at_zero,
)
from baldwinlab.analysis.assays.values import Assays, count_steps
from baldwinlab.analysis.figures.style import LINE_STYLES, MARKERS, SeriesStyle, styled
from baldwinlab.analysis.palette import NEWBORN_COLORS
from baldwinlab.core.variables import RANDOM_NEWBORNS

NEWBORN_STYLES: Final = [
    SeriesStyle(color, line, marker)
    for color, line, marker in zip(NEWBORN_COLORS, LINE_STYLES[::-1], MARKERS, strict=False)
]


@styled
def draw_within_life(assays: Assays, names: Sequence[str], unit: str) -> Figure:
    """Draw the items eaten by step of a lifetime, and the share of agents with a first meal.

    Parameters
    ----------
    assays : mapping of str to mapping of str to xr.Dataset
        Stored assays by assay and condition.
    names : sequence of str
        Conditions to draw.
    unit : str
        Label of fitness. Not used.

    Returns
    -------
    Figure
        Two panels per condition.
    """
    figure, grid = make_grid(assays["within-life"], names, rows=2, height=2.3)
    for (top, bottom), name in zip(grid, names, strict=True):
        data = assays["within-life"][name]
        steps = count_steps(data)
        for newborns, style in zip(_sort_newborns(data), NEWBORN_STYLES, strict=False):
            selected = data.sel(newborns=newborns)
            meal_rate = _compute_meal_rate(selected["eaten_in_window"].mean("agent"), steps)
            draw_curve(top, meal_rate, style, newborns, "window")
            _draw_first_meals(bottom, selected["first_meal"].values.ravel(), steps, style)
        start_at_zero(top)
        bottom.set(ylim=(0, 1.03), xlabel="step of the lifetime")
        top.set_xlim(0, steps)
    label_rows(grid, "items eaten by an\nagent in 100 steps", "share of agents with\na first meal")
    figure.legend(handles=list_handles(grid[:, 0]), loc="outside upper center", ncols=4)
    return figure


def _draw_first_meals(axes: Axes, first_meals: np.ndarray, steps: int, style: SeriesStyle) -> None:
    """Draw the share of agents that have eaten, by step."""
    times = np.sort(first_meals)
    # An agent that never eats has no first meal (NaN).
    times = times[np.isfinite(times)]
    shares = np.arange(1, times.size + 1) / first_meals.size
    axes.step(
        [0, *times, steps],
        [0, *shares, times.size / first_meals.size],
        where="post",
        color=style.color,
        ls=style.line,
    )


def _sort_newborns(data: xr.Dataset) -> list[str]:
    """Return the kinds of newborns: random genomes first, then by generation."""
    names = [str(name) for name in data["newborns"].values]
    return sorted(names, key=lambda name: -1 if name == RANDOM_NEWBORNS else int(name.split()[-1]))


def _compute_meal_rate(eaten: xr.DataArray, steps: int) -> xr.DataArray:
    """Return items per 100 steps at the middle of each window. The last window may be shorter."""
    starts = eaten["window"].values
    ends = np.append(starts[1:], steps)
    widths = xr.DataArray(ends - starts, dims="window")
    return (eaten * 100 / widths).assign_coords(window=(starts + ends) / 2)
