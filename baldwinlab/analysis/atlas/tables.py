"""Tables of the atlas: one row per cell and outcome."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import product
from typing import Any, Final

import xarray as xr

from baldwinlab.analysis.atlas.laws import Law
from baldwinlab.analysis.atlas.outcomes import OUTCOMES
from baldwinlab.analysis.atlas.statistics import estimate_mean
from baldwinlab.analysis.statistics.csv import finite_or_none, replace_undefined

RESIDUAL: Final = "residual"
COLUMNS: Final = ("map", "cell", "settings", "outcome", "mean", "low", "high", "runs", "law")


def list_cells(outcomes: xr.Dataset) -> Iterator[dict[str, Any]]:
    """Yield the values of the swept fields of each cell, in the order of the points."""
    fields = outcomes.attrs["fields"]
    for values in product(*(outcomes[field].values.tolist() for field in fields)):
        yield dict(zip(fields, values, strict=True))


def format_label(value: Any) -> str:
    """Return a value of a swept field for an axis or a table."""
    return f"{value:g}" if isinstance(value, int | float) else str(value)


def describe_settings(cell: Mapping[str, Any], labels: Mapping[str, str]) -> str:
    """Return the settings of a cell for a caption."""
    return ", ".join(f"{labels[field]}: {format_label(value)}" for field, value in cell.items())


def tabulate(name: str, outcomes: xr.Dataset, law: Law | None) -> list[dict[str, Any]]:
    """Return a row per cell and outcome, with the mean over runs and its 95 % interval.

    `law`: law of the map. The outcome "residual" is the predicted quantity. Returns rows with
    `COLUMNS`.
    """
    values = {outcome: outcomes[outcome] for outcome in OUTCOMES}
    prediction = None
    if law is not None:
        values[RESIDUAL] = law.measured(outcomes)
        prediction = law.predict(outcomes).broadcast_like(values[RESIDUAL].isel(run=0, drop=True))
    rows = []
    for number, cell in enumerate(list_cells(outcomes)):
        settings = ", ".join(f"{field} = {value}" for field, value in cell.items())
        for outcome, array in values.items():
            interval = estimate_mean(array.sel(cell))
            rows.append(
                {
                    "map": name,
                    "cell": f"point-{number:04d}",
                    "settings": settings,
                    "outcome": outcome,
                    **replace_undefined(interval._asdict()),
                    "law": finite_or_none(float(prediction.sel(cell)))
                    if prediction is not None and outcome == RESIDUAL
                    else None,
                }
            )
    return rows
