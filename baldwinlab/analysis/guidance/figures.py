"""Figures of the study what-guides: NK landscapes, the Markov chain, and other models."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from baldwinlab.analysis.atlas.tables import estimate_mean
from baldwinlab.analysis.figures.charts import EstimateStyle, draw_estimates, label_strips
from baldwinlab.analysis.figures.curves import make_panels
from baldwinlab.analysis.figures.style import FIGURE_WIDTH, GRAY, styled
from baldwinlab.analysis.guidance.predictions import (
    AGENTS,
    CONTROL,
    COSTLY_LEARNING,
    EQUAL_EVALUATIONS,
    LEARNING,
    POPULATION,
    TRIALS,
    K,
)
from baldwinlab.analysis.palette import BLACK, BLUE, BROWN, GREEN, PURPLE, SKY, VERMILION

STYLES: Final = {
    LEARNING: EstimateStyle(BLUE),
    COSTLY_LEARNING: EstimateStyle(SKY, "v"),
    "drift": EstimateStyle(VERMILION, "s"),
    "yoked": EstimateStyle(PURPLE, "^"),
    "random": EstimateStyle(BROWN, "P"),
    "random-targets": EstimateStyle(BROWN, "P"),
    EQUAL_EVALUATIONS: EstimateStyle(GREEN, "D"),
}
"""Marks of the arms that the figures show, in the order of the legend."""
EFFECT_LABEL: Final = "effect on innate fitness"
PANEL_HEIGHT: Final = 2.6
LEGEND_HEIGHT: Final = 0.6
ROW_HEIGHT: Final = 0.45
# Horizontal or vertical distance of the arms of a point.
OFFSET: Final = 0.07
# Settings of the panels: all but one of these, and the horizon, are fixed.
CENTER: Final[Mapping[str, float]] = {K: 5, TRIALS: 30, AGENTS: 100, "horizon": 100}
TITLES: Final = {
    K: "epistasis K",
    TRIALS: "trials in a life",
    AGENTS: "number of agents",
    "horizon": "common generations",
}


@styled
def draw_effects(groups: Sequence[xr.Dataset]) -> Figure:
    """Draw the effects on NK landscapes along each axis, at the center of the other axes.

    `groups`: cells with the fields K, TRIALS and AGENTS.
    """
    figure, panels = make_panels(len(TITLES), 2, PANEL_HEIGHT, LEGEND_HEIGHT)
    arms = [arm for arm in STYLES if arm in groups[0]["arm"]]
    for axes, axis in zip(panels.flat, TITLES, strict=True):
        points = _collect_points(groups, axis)
        values = sorted(points)
        for index, arm in enumerate(arms):
            offset = OFFSET * (index - (len(arms) - 1) / 2)
            estimates = [estimate_mean(points[value].sel(arm=arm))[:3] for value in values]
            positions = np.arange(len(values)) + offset
            draw_estimates(axes, positions, np.transpose(estimates), STYLES[arm], is_joined=True)
        axes.set_xticks(range(len(values)), [f"{value:g}" for value in values])
        axes.set_xlim(-0.5, len(values) - 0.5)
        axes.axhline(0, color=GRAY, lw=1)
        axes.set(xlabel=TITLES[axis], ylabel=EFFECT_LABEL)
    _draw_legend(figure, arms)
    return figure


def _collect_points(groups: Sequence[xr.Dataset], axis: str) -> dict[float, xr.DataArray]:
    """Return the effects (run, arm) of each value of an axis, at the center of the others."""
    fixed = {name: value for name, value in CENTER.items() if name not in (axis, "horizon")}
    points: dict[float, xr.DataArray] = {}
    for cells in groups:
        at_center = np.all([cells[name] == value for name, value in fixed.items()], axis=0)
        chosen = cells["effect"].sel(start=POPULATION).isel(cell=np.flatnonzero(at_center))
        for cell in chosen.transpose("cell", ...):
            if axis == "horizon":
                points |= {float(value): cell.sel(horizon=value) for value in cell["horizon"]}
            else:
                points[float(cell[axis])] = cell.sel(horizon=CENTER["horizon"])
    return points


def _draw_legend(figure: Figure, arms: Sequence[str]) -> None:
    lines = [Line2D([], [], ls="none", **STYLES[arm].marks) for arm in arms]
    figure.legend(lines, arms, loc="outside upper center", ncols=min(len(arms), 4))


@styled
def draw_chain(cells: xr.Dataset) -> Figure:
    """Draw the effect of learning by common generations beside the Markov chain, for each K."""
    figure, panels = make_panels(cells.sizes["cell"], 2, PANEL_HEIGHT, 0)
    horizons = [f"{horizon}" for horizon in cells["horizon"].values]
    positions = np.arange(len(horizons))
    for index, axes in zip(range(cells.sizes["cell"]), panels.flat, strict=False):
        cell = cells.isel(cell=index)
        predicted = cell["predicted"].sel(history=LEARNING) - cell["predicted"].sel(history=CONTROL)
        axes.plot(positions, predicted.mean("run"), color=BLACK, lw=1.2, label="chain")
        effects = cell["effect"].sel(arm=LEARNING, start=POPULATION)
        estimates = [estimate_mean(effects.sel(horizon=h))[:3] for h in cells["horizon"].values]
        draw_estimates(axes, positions, np.transpose(estimates), STYLES[LEARNING])
        axes.axhline(0, color=GRAY, lw=1)
        axes.set_xticks(positions, horizons)
        axes.set(xlabel=TITLES["horizon"], ylabel=EFFECT_LABEL, title=f"K = {int(cell[K])}")
    panels.flat[0].legend(loc="lower right")
    return figure


@styled
def draw_models(groups: Mapping[str, xr.Dataset], horizon: int) -> Figure:
    """Draw the relative effects of all arms in other models. `groups`: one cell each, by title."""
    figure = Figure((FIGURE_WIDTH, LEGEND_HEIGHT + ROW_HEIGHT * (1 + len(groups))))
    axes = figure.subplots()
    shown = [arm for arm in STYLES if any(arm in cells["arm"] for cells in groups.values())]
    for row, cells in enumerate(groups.values()):
        effects = cells["effect"].isel(cell=0).sel(start=POPULATION, horizon=horizon)
        for index, arm in enumerate(shown):
            if arm in effects["arm"]:
                position = row + 1.5 * OFFSET * (index - (len(shown) - 1) / 2)
                estimate = estimate_mean(effects.sel(arm=arm))[:3]
                draw_estimates(axes, position, estimate, STYLES[arm], is_horizontal=True)
    axes.axvline(0, color=GRAY, lw=1)
    label_strips(axes, list(groups))
    axes.set_xlabel(f"relative {EFFECT_LABEL}")
    _draw_legend(figure, shown)
    return figure
