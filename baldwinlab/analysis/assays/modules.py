"""Evaluation of the assay `modules`: fitness with evolved and with random modules."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from baldwinlab.analysis.assays.evaluation import AssayEvaluation, AssayFigure, QuantityValues
from baldwinlab.analysis.assays.panels import make_grid
from baldwinlab.analysis.assays.values import Stored
from baldwinlab.analysis.figures.style import BLACK, GRAY, spread_points, styled

# Vertical spread of the points of a kind of modules, and half of its median line, in rows.
POINT_SPREAD: Final = 0.4
HALF_MEDIAN_LINE: Final = 0.32


def compute_quantities(data: xr.Dataset, last: int) -> Iterator[QuantityValues]:
    for name in data["modules"].values:
        yield ("modules", str(name)), data["energy"].sel(modules=name).mean("agent")


@styled
def draw_modules(stored: Stored, names: Sequence[str], unit: str) -> Figure:
    """Draw the fitness of agents with evolved and with random modules, with one point per run.

    The figure has one panel per condition. A line is the median.
    """
    figure, grid = make_grid(stored, names, rows=1, height=2.3)
    for condition_index, (panels, name) in enumerate(zip(grid, names, strict=True)):
        axes = panels[0]
        data = stored[name]
        kinds = [str(kind) for kind in data["modules"].values]
        for row, kind in enumerate(kinds):
            fitness = data["energy"].sel(modules=kind).mean("agent").values
            offsets = POINT_SPREAD * spread_points(fitness.size)
            axes.plot(fitness, row + offsets, "o", color=GRAY, ms=3.2, alpha=0.6, mew=0)
            axes.vlines(
                np.median(fitness),
                row - HALF_MEDIAN_LINE,
                row + HALF_MEDIAN_LINE,
                color=BLACK,
                lw=1.8,
            )
        axes.set(
            yticks=range(len(kinds)),
            yticklabels=[kind.replace(", ", ",\n") for kind in kinds],
            xlabel=unit,
        )
        # Two conditions are next to each other, and only the left one has labels.
        is_left_panel = condition_index % 2 == 0
        axes.tick_params(labelleft=is_left_panel)
        axes.grid(visible=False, axis="y")
        axes.invert_yaxis()
    return figure


EVALUATION: Final = AssayEvaluation(
    assay="modules",
    order=40,
    compute_quantities=compute_quantities,
    measure_names={
        "modules": "fitness with these modules",
    },
    figures=(
        AssayFigure(
            name="modules",
            title="Fitness with evolved and random modules",
            caption=(
                "Agents of the last generation with both evolved modules, with one of them "
                "replaced by a random module, and with two random modules. Each point is a run, "
                "and the line is the median."
            ),
            draw=draw_modules,
            measures=("modules",),
        ),
    ),
)
