"""Numbers as text in reports and on the terminal, and in JSON and CSV for other programs."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from typing import Any


def format_number(value: float) -> str:
    """Return about three digits, such as "1,235", "12.3" or "1.23"; a dash if not finite.

    >>> format_number(1234.6), format_number(-12.34), format_number(0.001)
    ('1,235', '−12.3', '0.00')
    """
    if not math.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    text = f"{value:,.{_decimals(value)}f}"
    # A small negative number is shown as "0.00", without a minus sign.
    is_zero = float(text.replace(",", "")) == 0
    return text.removeprefix("-") if is_zero else text.replace("-", "−")


def _decimals(value: float) -> int:
    if abs(value) >= 100:
        return 0
    return 1 if abs(value) >= 10 else 2


def format_signed(value: float) -> str:
    """Return a number with its sign, such as "+1.23"; 0 has no sign."""
    return f"+{format_number(value)}" if value > 0 else format_number(value)


def format_p_value(p: float) -> str:
    """Return a p-value, such as "1.9e-09", "0.013" or "0.45"; a dash for NaN."""
    if math.isnan(p):
        return "–"
    if p < 0.001:
        return f"{p:.1e}"
    return f"{p:.3f}" if p < 0.1 else f"{p:.2f}"


def format_estimate(value: float, low: float, high: float) -> str:
    """Return "1.20 [1.10, 1.30]": a value and the interval, or "1.20" without an interval.

    >>> format_estimate(15.75, 2.88, 44.6)
    '15.8 [2.88, 44.6]'
    """
    interval = "" if math.isnan(low) else f" [{format_number(low)}, {format_number(high)}]"
    return f"{format_number(value)}{interval}"


def join_names(names: Sequence[str]) -> str:
    """Return names as text, such as "C1, C2 and C3"; "" without names."""
    *preceding, last = names or [""]
    return f"{', '.join(preceding)} and {last}" if preceding else last


def finite_or_none(value: float) -> float | None:
    """Return a number, or None for NaN and the infinities, which JSON cannot hold."""
    return value if math.isfinite(value) else None


def replace_undefined(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return values for JSON, with None for each float that is NaN or infinite."""
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
