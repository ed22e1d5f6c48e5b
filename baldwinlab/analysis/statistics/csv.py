"""Write numbers and tables for other programs."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from typing import Any


def finite_or_none(value: float) -> float | None:
    """Return a number, or None for NaN and the infinities, which JSON cannot hold."""
    return value if math.isfinite(value) else None


def replace_undefined(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return a record for JSON: `finite_or_none` of its numbers."""
    return {
        name: finite_or_none(value) if isinstance(value, float) else value
        for name, value in values.items()
    }


def to_csv(columns: Sequence[str], rows: Sequence[Mapping[str, Any]]) -> bytes:
    """Write a table as CSV in UTF-8, with a header and full precision.

    A missing value and NaN are empty cells.
    """
    text = io.StringIO()
    table = csv.DictWriter(text, columns, lineterminator="\n")
    table.writeheader()
    table.writerows({name: _cell(value) for name, value in row.items()} for row in rows)
    return text.getvalue().encode()


def _cell(value: object) -> object:
    return "" if isinstance(value, float) and math.isnan(value) else value
