"""Numbers as text, in reports and on the terminal."""

from __future__ import annotations

import math
from collections.abc import Sequence


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
