"""Grids of the cells of a map for the page: colored cells with links to their curves."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.colors import to_hex

from baldwinlab.analysis.atlas.cell_curves import draw_panels
from baldwinlab.analysis.atlas.figures import COLORMAP, choose_outcome, is_light
from baldwinlab.analysis.atlas.laws import Law
from baldwinlab.analysis.atlas.outcomes import OUTCOMES
from baldwinlab.analysis.atlas.statistics import estimate_mean
from baldwinlab.analysis.atlas.tables import describe_settings, format_label, list_cells
from baldwinlab.analysis.palette import PALE

UNDEFINED_TEXT: Final = "–"
LETTERS: Final = {
    "assimilation": "A",
    "innate_response": "I",
    "selection_ratio": "P",
    "t90": "t90",
    "fork_history": "history",
    "fork_regime": "regime",
}


def describe_cells(
    name: str,
    outcomes: xr.Dataset,
    labels: Mapping[str, str],
    values: Sequence[xr.Dataset],
    law: Law | None,
) -> list[dict[str, Any]]:
    """Return the template values of each cell, in the order of the points."""
    measured = law.measured(outcomes).mean("run") if law else None
    predicted = (
        law.predict(outcomes).broadcast_like(measured) if law and measured is not None else None
    )
    shown = choose_outcome(outcomes)
    described = []
    for number, (cell, curves) in enumerate(zip(list_cells(outcomes), values, strict=True)):
        selected = outcomes.sel(cell)
        value = float(selected[shown.name].mean("run"))
        described.append(
            {
                "id": f"{name}-{number:04d}",
                "caption": describe_settings(cell, labels),
                "settings": cell,
                "value": _format(value),
                "color": _choose_color(shown.scale(value)),
                "text_color": "black" if is_light(shown.scale(value)) else "white",
                "residual": _format(float(measured.sel(cell))) if measured is not None else "",
                "law": _format(float(predicted.sel(cell))) if predicted is not None else "",
                "outcomes": {
                    LETTERS[outcome]: str(estimate_mean(selected[outcome])) for outcome in OUTCOMES
                },
                "panels": draw_panels(curves),
            }
        )
    return described


def _format(value: float) -> str:
    return f"{value:.2f}" if np.isfinite(value) else UNDEFINED_TEXT


def _choose_color(share: float) -> str:
    if not np.isfinite(share):
        return PALE
    return to_hex(colormaps[COLORMAP](np.clip(share, 0, 1)))


def arrange_grids(
    outcomes: xr.Dataset, labels: Mapping[str, str], cells: Sequence[Mapping[str, Any]]
) -> Iterator[dict[str, Any]]:
    """Yield a grid of the first two axes for each combination of the other axes."""
    rows, columns, *other_axes = outcomes.attrs["fields"]
    by_settings = {tuple(cell["settings"].items()): cell for cell in cells}
    for fixed in product(*(outcomes[field].values.tolist() for field in other_axes)):
        other_settings = dict(zip(other_axes, fixed, strict=True))
        yield {
            "caption": describe_settings(other_settings, labels),
            "columns": [format_label(value) for value in outcomes[columns].values.tolist()],
            "rows": [
                {
                    "value": format_label(row),
                    "cells": [
                        # The order of the fields is that of the settings of a cell.
                        by_settings[tuple({rows: row, columns: column, **other_settings}.items())]
                        for column in outcomes[columns].values.tolist()
                    ],
                }
                for row in outcomes[rows].values.tolist()
            ],
        }
