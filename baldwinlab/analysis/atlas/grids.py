"""Grids of the cells of a map for the page: colored cells with links to their curves.

The curves of a cell are inline SVG. The page draws the first run as an animation.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from typing import Any, Final

import numpy as np
import numpy.typing as npt
import xarray as xr
from markupsafe import Markup
from matplotlib import colormaps
from matplotlib.colors import to_hex, to_rgb

from baldwinlab.analysis.atlas.figures import choose_outcome, format_cell
from baldwinlab.analysis.atlas.laws import Law
from baldwinlab.analysis.atlas.outcomes import OUTCOMES
from baldwinlab.analysis.atlas.tables import (
    describe_settings,
    estimate_mean,
    format_label,
    list_cells,
)
from baldwinlab.analysis.figures.charts import CIVIDIS
from baldwinlab.analysis.palette import PALE, choose_text_color
from baldwinlab.analysis.report.tables import Table

# Short names of the outcomes in a cell.
LETTERS: Final = {
    "assimilation": "A",
    "learner_fall": "fall of learners",
    "control_fall": "fall of the control",
    "neutral_fall": "fall without selection",
    "innate_response": "I",
    "selection_ratio": "P",
    "t90": "t90",
    "fork_history": "history",
    "fork_regime": "regime",
}
# Size of a panel of curves, and the margin of the curves, in units of the SVG.
WIDTH: Final = 420
HEIGHT: Final = 130
MARGIN: Final = 6

Floats = npt.NDArray[np.float64]


def describe_cells(
    name: str,
    outcomes: xr.Dataset,
    labels: Mapping[str, str],
    values: Sequence[xr.Dataset],
    law: Law | None,
) -> list[dict[str, Any]]:
    """Return the template values of each cell. `values`: variables of `reduce_cell` by cell."""
    measured = law.measured(outcomes).mean("run") if law else None
    predicted = (
        law.predict(outcomes).broadcast_like(measured) if law and measured is not None else None
    )
    shown = choose_outcome(outcomes)
    described = []
    for number, (cell, curves) in enumerate(zip(list_cells(outcomes), values, strict=True)):
        selected = outcomes.sel(cell)
        value = float(selected[shown.name].mean("run"))
        color = _choose_color(shown.scale(value))
        described.append(
            {
                "id": f"{name}-{number:04d}",
                "caption": describe_settings(cell, labels),
                "settings": cell,
                "value": shown.format(value),
                "color": color,
                "text_color": choose_text_color(to_rgb(color)),
                "residual": format_cell(float(measured.sel(cell))) if measured is not None else "",
                "law": _format_law(predicted.sel(cell)) if predicted is not None else "",
                "outcomes": {
                    LETTERS[outcome]: str(estimate_mean(selected[outcome])) for outcome in OUTCOMES
                },
                "panels": [*draw_panels(curves)],
            }
        )
    return described


def _format_law(prediction: xr.DataArray) -> str:
    """Return the prediction of a cell, or "" if the law is not derived for the cell."""
    return format_cell(float(prediction)) if bool(prediction.notnull()) else ""


def _choose_color(share: float) -> str:
    if not np.isfinite(share):
        return PALE
    return to_hex(colormaps[CIVIDIS](np.clip(share, 0, 1)))


def arrange_grids(
    title: str,
    outcomes: xr.Dataset,
    labels: Mapping[str, str],
    cells: Sequence[Mapping[str, Any]],
) -> Iterator[Table]:
    """Yield a grid of the first two axes for each combination of the other axes."""
    rows, columns, *other_axes = outcomes.attrs["fields"]
    letter = LETTERS[choose_outcome(outcomes).name]
    by_settings = {tuple(cell["settings"].items()): _link(cell, letter) for cell in cells}
    column_values = outcomes[columns].values.tolist()
    headings = dict.fromkeys(map(format_label, column_values), "right")
    corner = f"{labels[rows]} \\ {labels[columns]}"
    for fixed in product(*(outcomes[field].values.tolist() for field in other_axes)):
        other_settings = dict(zip(other_axes, fixed, strict=True))
        groups = []
        for row in outcomes[rows].values.tolist():
            # The tuples are equal only if the fields have the order of the settings of a cell.
            keys = [{rows: row, columns: column, **other_settings} for column in column_values]
            links = [by_settings[tuple(settings.items())] for settings in keys]
            groups.append((format_label(row), [links]))
        caption = describe_settings(other_settings, labels)
        label = f"{title} {caption}".rstrip()
        yield Table(label, {corner: "", **headings}, groups, "numbers cells", caption)


def _link(cell: Mapping[str, Any], letter: str) -> Markup:
    """Return the value of a cell, in its color, with a link to its curves."""
    law = Markup("<br><small>{} | {}</small>").format(cell["residual"], cell["law"])
    return Markup(
        '<a href="#{}" style="background:{};color:{}" aria-label="{}: {} = {}">{}{}</a>'
    ).format(
        *(cell[key] for key in ("id", "color", "text_color", "caption")),
        *(letter, cell["value"], cell["value"], law if cell["law"] else ""),
    )


def draw_panels(cell: xr.Dataset) -> Iterator[dict[str, Any]]:
    """Yield the panels of a cell, with curves over the generations and their range."""
    names = {"learned distance": "distance", "innate trait": "innate_trait"}
    if "distance" not in cell or not cell["distance"].notnull().any():
        del names["learned distance"]
    generations = cell["generation"].values.astype(np.float64)
    for title, name in names.items():
        curves = {
            "mean": cell[name].mean("run").values,
            "control": cell[f"control_{name}"].mean("run").values,
            "replay": cell[name].isel(run=0).values,  # The first run.
        }
        stacked = np.concatenate([curve[np.isfinite(curve)] for curve in curves.values()])
        low, high = (float(stacked.min()), float(stacked.max())) if stacked.size else (0.0, 1.0)
        lines = {kind: _project(generations, curve, low, high) for kind, curve in curves.items()}
        yield {"title": title, "low": low, "high": high, "lines": lines}


def _project(generations: Floats, curve: Floats, low: float, high: float) -> str:
    """Return the points of a polyline, for example "6,124 414,6"."""
    # A constant curve has the range 0, and `or 1.0` avoids a division by 0.
    length = generations[-1] - generations[0] or 1.0
    x = MARGIN + (WIDTH - 2 * MARGIN) * (generations - generations[0]) / length
    y = HEIGHT - MARGIN - (HEIGHT - 2 * MARGIN) * (curve - low) / ((high - low) or 1.0)
    return " ".join(
        f"{column:.0f},{row:.0f}" for column, row in zip(x, y, strict=True) if np.isfinite(row)
    )
