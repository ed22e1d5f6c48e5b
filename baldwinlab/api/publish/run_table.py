"""The table "All runs" of the lab: one row per run, with its final values.

The page draws the columns that this module describes. `_list_values` is the only list of them.
"""

from __future__ import annotations

from math import isnan
from typing import Any, Final, NamedTuple

from baldwinlab.analysis.statistics import fitness
from baldwinlab.core.deferred import xr
from baldwinlab.experiment.outcome import describe_measures
from baldwinlab.studies.open import sample_runs
from baldwinlab.studies.store import StudyStore

DEFAULT_LAST: Final = 10
"""Default number of final generations of the report."""
SORTED_COLUMN: Final = "mean"
"""The column by which the table is sorted at first."""


class ValueColumn(NamedTuple):
    """A column with one number per run."""

    title: str
    values: xr.DataArray  # [condition, run]


def _list_values(data: xr.Dataset) -> dict[str, ValueColumn]:
    """Return the columns with a number, by key. The key is also the heading of the CSV file."""
    return {
        measure: ValueColumn(f"{text['name']}, {text['axis']}", fitness.final(data, measure))
        for measure, text in describe_measures(fitness.outcome(data)).items()
    }


def record_runs(study: StudyStore, data: xr.Dataset) -> dict[str, Any]:
    """Return the table as plain data: `columns`, `rows` by key of the column, and texts.

    `order` of a column is that of the first click on its heading. An undefined number is None.
    """
    numbers = _list_values(data)
    rows: list[dict[str, Any]] = []
    for name in data["condition"].values.tolist():
        runs = sample_runs(study, name)
        values = [
            to_list(column.values.sel(condition=name, run=runs)) for column in numbers.values()
        ]
        rows += [
            {"condition": name, "run": run, **dict(zip(numbers, row, strict=True))}
            for run, *row in zip(runs, *values, strict=True)
        ]
    return {
        "note": f"averaged over the last {DEFAULT_LAST} generations",
        "columns": [
            _describe_column("condition", "condition", "text"),
            _describe_column("run", "run", "text"),
            *(_describe_column(key, column.title, "number") for key, column in numbers.items()),
        ],
        "sorted": SORTED_COLUMN,
        "rows": rows,
    }


def _describe_column(key: str, title: str, cell_format: str) -> dict[str, str]:
    """Return a column as the page draws it: the largest number is first, and the first name."""
    order = "descending" if cell_format == "number" else "ascending"
    return {"key": key, "title": title, "format": cell_format, "order": order}


def to_list(values: xr.DataArray) -> list[float | None]:
    """Return the values as a list, with None for NaN."""
    return [None if isnan(value) else value for value in values.values.tolist()]
