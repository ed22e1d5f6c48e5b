"""Evaluation of the assay `within-life`: eaten items by the step of the lifetime."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from baldwinlab.analysis.assays.evaluation import (
    BANDS_NOTE,
    RANDOM_NEWBORNS,
    AssayEvaluation,
    AssayFigure,
    QuantityValues,
    Stored,
    parse_generation,
)
from baldwinlab.analysis.assays.panels import (
    NEWBORN_STYLES,
    draw_medians,
    make_blocks_of_conditions,
)
from baldwinlab.analysis.figures.curves import (
    draw_legend_of_panels,
    draw_line,
    label_blocks,
    start_at_zero,
)
from baldwinlab.analysis.figures.style import SeriesStyle, styled
from baldwinlab.experiment.toml import from_toml

# A meal rate is the number of items eaten in this number of steps.
RATE_STEPS: Final = 100


def count_steps(within_life: xr.Dataset) -> int:
    """Return the number of steps of a lifetime."""
    text = within_life.attrs["experiment"]
    return from_toml(text, source="the assay", lenient=True).lifetime.steps


def name_latest_newborns(within_life: xr.Dataset) -> str:
    """Return the name of the latest measured newborns, for example "generation 99", or ""."""
    names = [str(name) for name in within_life["newborns"].values if name != RANDOM_NEWBORNS]
    return max(names, key=parse_generation, default="")


def compute_quantities(data: xr.Dataset, last: int) -> Iterator[QuantityValues]:
    n_steps = count_steps(data)
    names_by_agents = {
        RANDOM_NEWBORNS: RANDOM_NEWBORNS,
        "evolved": name_latest_newborns(data),
    }
    for agents, name in names_by_agents.items():
        # No generation was measured if `name` is "".
        if name not in data["newborns"].values:
            continue
        newborns = data.sel(newborns=name)
        eaten = newborns["eaten_in_window"].mean("agent")
        # A window without a value would count as 0 in a sum.
        is_complete = eaten.notnull().all("window")
        first_meal = newborns["first_meal"]
        yield ("eaten in life", agents), eaten.sum("window").where(is_complete)
        yield ("eaten in the first part of life", agents), eaten.isel(window=0)
        yield ("eaten in the last part of life", agents), eaten.isel(window=-1)
        # An agent that never eats counts with the number of steps of a lifetime.
        yield ("first meal", agents), first_meal.fillna(n_steps).mean("agent").where(is_complete)
        yield ("ever ate", agents), first_meal.notnull().mean("agent").where(is_complete)


@styled
def draw_within_life(stored: Stored, names: Sequence[str], unit: str) -> Figure:
    """Draw the items eaten by step of a lifetime, and the share of agents with a first meal."""
    figure, grid = make_blocks_of_conditions(stored, names, 2, 2.3)
    for (top, bottom), name in zip(grid, names, strict=True):
        data = stored[name]
        n_steps = count_steps(data)
        for newborns, style in zip(_sort_newborns(data), NEWBORN_STYLES, strict=False):
            selected = data.sel(newborns=newborns)
            meal_rate = _compute_meal_rate(selected["eaten_in_window"].mean("agent"), n_steps)
            draw_medians(top, meal_rate, style, newborns, "window")
            _draw_first_meals(bottom, selected["first_meal"].values.ravel(), n_steps, style)
        start_at_zero(top)
        bottom.set(ylim=(0, 1.03), xlabel="step of the lifetime")
        top.set_xlim(0, n_steps)
    label_blocks(
        grid,
        f"items eaten by an\nagent in {RATE_STEPS} steps",
        "share of agents with\na first meal",
    )
    draw_legend_of_panels(figure, grid[:, 0], 4)
    return figure


def _draw_first_meals(
    axes: Axes, first_meals: np.ndarray, n_steps: int, style: SeriesStyle
) -> None:
    """Draw the fraction of agents that have eaten, by step. The line starts at 0."""
    # An agent that never eats has no first meal (NaN).
    times = np.sort(first_meals[np.isfinite(first_meals)])
    shares = np.arange(1, times.size + 1) / first_meals.size
    final_share = times.size / first_meals.size
    steps = [0, *times, n_steps]
    draw_line(axes, steps, [0, *shares, final_share], style, is_stepped=True)


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


EVALUATION: Final = AssayEvaluation(
    assay="within-life",
    order=30,
    compute_quantities=compute_quantities,
    measure_names={
        "first meal": "steps to the first meal",
        "ever ate": "share of agents that eat",
        "eaten in life": "items eaten in a lifetime",
        "eaten in the first part of life": "items eaten in the first part of a lifetime",
        "eaten in the last part of life": "items eaten in the last part of a lifetime",
    },
    figures=(
        AssayFigure(
            name="within-life",
            title="Behavior within a lifetime",
            caption=(
                "Newborns of several generations, and random genomes that also learn. Top: items "
                "that an agent eats in 100 steps, by step of its lifetime. Bottom: share of the "
                f"agents of all runs that have had their first meal. {BANDS_NOTE}"
            ),
            draw=draw_within_life,
            measures=("eaten in life", "first meal"),
        ),
    ),
)
