"""Figure of the meals within a lifetime."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from baldwinlab.analysis.assays.panels import (
    NEWBORN_STYLES,
    draw_curve,
    label_rows,
    list_handles,
    make_grid,
    start_at_zero,
)
from baldwinlab.analysis.assays.values import Assays, count_steps, parse_generation
from baldwinlab.analysis.figures.style import SeriesStyle, styled
from baldwinlab.core.assay_variables import RANDOM_NEWBORNS

# Number of time steps to which a meal rate refers.
RATE_STEPS: Final = 100


@styled
def draw_within_life(assays: Assays, names: Sequence[str], unit: str) -> Figure:
    """Draw the items eaten by step of a lifetime, and the share of agents with a first meal.

    `unit`: label of fitness. Not used. The figure has two panels per condition.
    """
    figure, grid = make_grid(assays["within-life"], names, rows=2, height=2.3)
    for (top, bottom), name in zip(grid, names, strict=True):
        data = assays["within-life"][name]
        n_steps = count_steps(data)
        for newborns, style in zip(_sort_newborns(data), NEWBORN_STYLES, strict=False):
            selected = data.sel(newborns=newborns)
            meal_rate = _compute_meal_rate(selected["eaten_in_window"].mean("agent"), n_steps)
            draw_curve(top, meal_rate, style, newborns, "window")
            _draw_first_meals(bottom, selected["first_meal"].values.ravel(), n_steps, style)
        start_at_zero(top)
        bottom.set(ylim=(0, 1.03), xlabel="step of the lifetime")
        top.set_xlim(0, n_steps)
    label_rows(
        grid,
        f"items eaten by an\nagent in {RATE_STEPS} steps",
        "share of agents with\na first meal",
    )
    figure.legend(handles=list_handles(grid[:, 0]), loc="outside upper center", ncols=4)
    return figure


def _draw_first_meals(
    axes: Axes, first_meals: np.ndarray, n_steps: int, style: SeriesStyle
) -> None:
    """Draw the share of agents that have eaten, by step."""
    # An agent that never eats has no first meal (NaN).
    times = np.sort(first_meals[np.isfinite(first_meals)])
    shares = np.arange(1, times.size + 1) / first_meals.size
    final_share = times.size / first_meals.size
    axes.step(
        [0, *times, n_steps],
        [0, *shares, final_share],
        where="post",
        color=style.color,
        ls=style.line,
    )


def _sort_newborns(data: xr.Dataset) -> list[str]:
    """Return the kinds of newborns: random genomes first, then by generation."""
    names = [str(name) for name in data["newborns"].values]
    evolved = sorted((name for name in names if name != RANDOM_NEWBORNS), key=parse_generation)
    return [name for name in names if name == RANDOM_NEWBORNS] + evolved


def _compute_meal_rate(eaten: xr.DataArray, n_steps: int) -> xr.DataArray:
    """Return items per 100 steps at the middle of each window. The last window may be shorter."""
    starts = eaten["window"].values
    ends = np.append(starts[1:], n_steps)
    widths = xr.DataArray(ends - starts, dims="window")
    return (eaten * RATE_STEPS / widths).assign_coords(window=(starts + ends) / 2)
