"""Curves of a cell as inline SVG. A run is drawn generation by generation when it is shown."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr

WIDTH: Final = 420
HEIGHT: Final = 130
MARGIN: Final = 6

Floats = npt.NDArray[np.float64]


class CurvePanel(NamedTuple):
    """A panel of curves over the generations."""

    title: str
    # Range of the vertical axis.
    low: float
    high: float
    # "kind" ("run", "mean", "control" or "replay") and "points" of each line.
    lines: list[dict[str, Any]]


def draw_panels(cell: xr.Dataset) -> list[CurvePanel]:
    """Return the panels of a cell: the learned distance and the innate trait."""
    panels = []
    if "distance" in cell and bool(cell["distance"].notnull().any()):
        panels.append(_draw_panel("learned distance", cell["distance"]))
    trait = cell["innate_trait"]
    panels.append(_draw_panel("innate trait", trait, cell["control_innate_trait"]))
    return panels


def _draw_panel(
    title: str, values: xr.DataArray, control: xr.DataArray | None = None
) -> CurvePanel:
    curves = {"mean": values.mean("run").values}
    if control is not None:
        curves["control"] = control.mean("run").values
    first_run = values.isel(run=0).values
    curves["replay"] = first_run
    stacked = np.concatenate([curve[np.isfinite(curve)] for curve in curves.values()])
    low, high = (float(stacked.min()), float(stacked.max())) if stacked.size else (0.0, 1.0)
    generations = values["generation"].values.astype(np.float64)
    lines = [
        {"kind": kind, "points": _project(generations, curve, low, high)}
        for kind, curve in curves.items()
    ]
    return CurvePanel(title, low, high, lines)


def _project(generations: Floats, curve: Floats, low: float, high: float) -> str:
    """Return the points of a polyline."""
    length = generations[-1] - generations[0] or 1.0
    x = MARGIN + (WIDTH - 2 * MARGIN) * (generations - generations[0]) / length
    y = HEIGHT - MARGIN - (HEIGHT - 2 * MARGIN) * (curve - low) / ((high - low) or 1.0)
    return " ".join(
        f"{column:.0f},{row:.0f}" for column, row in zip(x, y, strict=True) if np.isfinite(row)
    )
