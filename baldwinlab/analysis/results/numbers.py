"""Numbers as text in reports and on the terminal, and in JSON and CSV for other programs."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

# Smaller numbers have an exponent.
MIN_PLAIN: Final = 1e-4


def format_number(value: float) -> str:
    """Return about three digits, such as "1,235", "12.3" or "1.23"; a dash if not finite.

    >>> format_number(1234.6), format_number(-12.34), format_number(0.000647)
    ('1,235', '−12.3', '0.000647')
    """
    return format_numbers([value])[0]


def format_numbers(values: Sequence[float]) -> list[str]:
    """Return numbers that are read together. Different numbers have different texts.

    >>> format_numbers([12.34, 12.31, 44.6]), format_numbers([0.0, 1e-5])
    (['12.34', '12.31', '44.60'], ['0', '1.00e-05'])
    """
    return _distinguish([float(value) for value in values], _format_decimals)


def format_levels(values: Sequence[Any], digits: int = 4) -> list[str]:
    """Return the values of a setting without trailing zeros. Different numbers have other texts.

    `digits`: number of significant digits that are enough for most values.

    >>> format_levels([0.1, 1e-5, "tournament"]), format_levels([1.00001, 1.00002])
    (['0.1', '1e-05', 'tournament'], ['1.00001', '1.00002'])
    """
    numbers = [value for value in values if isinstance(value, float)]
    texts = _distinguish(numbers, lambda value, extra: f"{value:.{digits + extra}g}")
    text_by_number = dict(zip(numbers, texts, strict=True))
    return [text_by_number[value] if isinstance(value, float) else str(value) for value in values]


def _distinguish(numbers: Sequence[float], write: Callable[[float, int], str]) -> list[str]:
    """Return each number as text, with the fewest digits that distinguish the numbers.

    `write`: returns a number with a number of additional digits.
    """
    # Numbers that differ only after ten digits differ by rounding.
    different = {float(f"{number:.10g}") for number in numbers if math.isfinite(number)}
    extra = 0
    while len({write(number, extra) for number in different}) < len(different):
        extra += 1
    return [write(number, extra) for number in numbers]


def _format_decimals(value: float, extra: int) -> str:
    size = abs(value)
    sign = "−" if value < 0 else ""
    if not math.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    if size < MIN_PLAIN:
        return f"{sign}{size:.{2 + extra}e}"
    # A smaller number would be 0.00 with two decimals.
    small_decimals = 2 if size >= 0.005 else 2 - math.floor(math.log10(size))
    decimals = 0 if size >= 100 else 1 if size >= 10 else small_decimals
    return f"{sign}{size:,.{decimals + extra}f}"


def format_percentage(share: float, sign: str = "") -> str:
    """Return a percentage: "0 %" and "100 %" only for 0 and 1. `sign`: "+" for "+34 %"."""
    numbers = [abs(100 * share), 0.0, 100.0]
    percentage = _distinguish(numbers, lambda number, extra: f"{number:.{extra}f}")[0]
    return f"{'-' if share < 0 else sign}{percentage} %"


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


def format_estimate(value: float, low: float, high: float, digits: int = 0) -> str:
    """Return "1.20 [1.10, 1.30]": a value and the interval, or "1.20" without an interval.

    `digits`: number of significant digits without trailing zeros, by default that of
    `format_numbers`.

    >>> format_estimate(15.75, 2.88, 44.6)
    '15.8 [2.88, 44.6]'
    """
    numbers = [value] if math.isnan(low) else [value, low, high]
    first, *interval = format_levels(numbers, digits) if digits else format_numbers(numbers)
    return f"{first} [{', '.join(interval)}]" if interval else first


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
