"""Evaluation of the assay `modules`: fitness with evolved or random action and reinforcement."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import xarray as xr
from matplotlib.figure import Figure

from baldwinlab.analysis.assays.evaluation import (
    AssayEvaluation,
    AssayFigure,
    QuantityValues,
    Stored,
)
from baldwinlab.analysis.assays.panels import make_blocks_of_conditions
from baldwinlab.analysis.figures.charts import draw_strip, label_strips
from baldwinlab.analysis.figures.style import GRAY, styled


def compute_quantities(data: xr.Dataset, last: int) -> Iterator[QuantityValues]:
    for name in data["modules"].values:
        yield ("modules", str(name)), data["energy"].sel(modules=name).mean("agent")


@styled
def draw_modules(stored: Stored, names: Sequence[str], unit: str) -> Figure:
    """Draw the fitness of agents with evolved and with random modules, by run."""
    figure, grid = make_blocks_of_conditions(stored, names, 1, 2.3)
    for condition_index, (panels, name) in enumerate(zip(grid, names, strict=True)):
        axes = panels[0]
        data = stored[name]
        kinds = [str(kind) for kind in data["modules"].values]
        for row, kind in enumerate(kinds):
            fitness = data["energy"].sel(modules=kind).mean("agent").values
            draw_strip(axes, row, fitness, GRAY)
        label_strips(axes, [kind.replace(", ", ",\n") for kind in kinds])
        axes.set_xlabel(unit)
        # Two conditions are next to each other. Only the left panel needs labels.
        is_left_panel = condition_index % 2 == 0
        axes.tick_params(labelleft=is_left_panel)
        axes.grid(visible=False, axis="y")
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
