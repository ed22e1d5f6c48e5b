"""Numbers as text in reports and on the terminal, and in JSON and CSV for other programs."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from typing import Any


def format_number(value: float) -> str:
    """Return about three digits of a number, or a dash if it is not finite."""
    if not math.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    text = f"{value:,.{_decimals(value)}f}"
    is_zero = float(text.replace(",", "")) == 0
    return text.removeprefix("-") if is_zero else text.replace("-", "−")


def _decimals(value: float) -> int:
    if abs(value) >= 100:
        return 0
    return 1 if abs(value) >= 10 else 2


def format_signed(value: float) -> str:
    """Return a number with its sign."""
    return f"+{format_number(value)}" if value > 0 else format_number(value)


def format_p_value(p: float) -> str:
    """Return a p-value, or a dash if it is NaN."""
    if math.isnan(p):
        return "–"
    if p < 0.001:
        return f"{p:.1e}"
    return f"{p:.3f}" if p < 0.1 else f"{p:.2f}"


def format_estimate(value: float, low: float, high: float) -> str:
    """Return a value with its 95 % interval, such as "1.20 [1.10, 1.30]", if that is defined."""
    interval = "" if math.isnan(low) else f" [{format_number(low)}, {format_number(high)}]"
    return f"{format_number(value)}{interval}"


def join_names(names: Sequence[str]) -> str:
    """Return a list in words, such as "C1, C2 and C3"."""
    *preceding, last = names or [""]
    return f"{', '.join(preceding)} and {last}" if preceding else last


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
    """Write a table as CSV in UTF-8, with full precision. Missing values and NaN are empty."""
    text = io.StringIO()
    table = csv.DictWriter(text, columns, lineterminator="\n")
    table.writeheader()
    table.writerows({name: _cell(value) for name, value in row.items()} for row in rows)
    return text.getvalue().encode()


def _cell(value: object) -> object:
    return "" if isinstance(value, float) and math.isnan(value) else value
