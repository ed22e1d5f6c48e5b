"""Figure of the reaction norms over the amount of learning."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from baldwinlab.analysis.assays.panels import (
    NEWBORN_STYLES,
    draw_curve,
    label_rows,
    list_handles,
    make_grid,
)
from baldwinlab.analysis.assays.values import Assays
from baldwinlab.analysis.figures.style import styled


@styled
def draw_norms(assays: Assays, names: Sequence[str], unit: str) -> Figure:
    """Draw fitness by the multiple of the amount of learning.

    The figure has one panel per condition, one line per generation.
    """
    figure, grid = make_grid(assays["reaction-norms"], names, rows=1, height=2.3)
    for (axes,), name in zip(grid, names, strict=True):
        data = assays["reaction-norms"][name]
        fitness = data["energy"].mean("agent")
        labels = [f"{factor:g}" for factor in data["factor"].values]
        # Factors are powers of 2 except 0, so that their order is their position.
        positions = fitness.assign_coords(factor=np.arange(len(labels)))
        generations = data["generation"].values.tolist()
        for generation, style in zip(generations, NEWBORN_STYLES, strict=False):
            norm = positions.sel(generation=generation)
            draw_curve(axes, norm, style, f"generation {generation}", "factor")
        axes.set_xticks(range(len(labels)), labels)
        axes.set_xlabel("multiple of the amount of learning")
    label_rows(grid, unit)
    figure.legend(handles=list_handles(grid[:, 0]), loc="outside upper center", ncols=4)
    return figure
