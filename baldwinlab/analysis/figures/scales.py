"""Logarithmic axes. Their ticks are numbers without exponents, which would be too small to read."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from baldwinlab.analysis.figures.panels import locate_panel
from baldwinlab.analysis.typeface import TEXT_SIZE

# Smaller and larger numbers are not written with all digits.
PLAIN_NUMBERS: Final = (1e-4, 1e6)
LARGE_UNITS: Final = {"billion": 1e9, "million": 1e6}
# Mean width of a digit, and smallest distance between two labels, in font sizes.
DIGIT_WIDTH: Final = 0.62
LABEL_GAP: Final = 0.8
# With fewer powers of ten, the labels also have 2 and 5 times the powers.
MIN_POWERS: Final = 3


def use_log_scale(axes: Axes, linear_limit: float | None = None) -> None:
    """Make the horizontal axis of a drawn panel logarithmic, with labels that do not overlap.

    `linear_limit`: the scale is linear up to this number, so that it can show 0.
    """
    if linear_limit is None:
        axes.set_xscale("log")
    else:
        axes.set_xscale("symlog", linthresh=linear_limit)
    low, high = axes.get_xlim()
    proposals = [
        [tick for tick in ticks if low <= tick <= high]
        for ticks in _propose_ticks(low, high, linear_limit)
    ]
    ticks = next((ticks for ticks in proposals if _have_space(axes, ticks)), proposals[-1])
    axes.set_xticks(ticks, [format_tick(tick) for tick in ticks])
    axes.minorticks_off()


def format_tick(value: float) -> str:
    """Return a round number whose characters have one size, such as "1,000".

    >>> format_tick(0.001), format_tick(-1000), format_tick(2e7), format_tick(1e-6)
    ('0.001', '−1,000', '20 million', '1e−6')
    """
    low, high = PLAIN_NUMBERS
    size = abs(value)
    if size >= high:
        name, unit = next(entry for entry in LARGE_UNITS.items() if size >= entry[1])
        text = f"{value / unit:,.10g} {name}"
    elif size >= low or size == 0:
        text = f"{value:,.10g}"
    else:
        digits, _, exponent = f"{value:.10g}".partition("e")
        text = f"{digits}e{int(exponent)}"
    return text.replace("-", "−")


def _propose_ticks(low: float, high: float, linear_limit: float | None) -> Iterator[list[float]]:
    """Yield ticks: powers of ten, then every second power, and so on.

    A range with few powers of ten first has more ticks per power, or evenly spaced ticks.
    """
    smallest, largest = linear_limit or low, max(-low, high)
    exponents = range(math.floor(math.log10(smallest)), math.floor(math.log10(largest)) + 1)
    powers = [10.0**exponent for exponent in exponents if 10.0**exponent >= smallest]
    if linear_limit is None and len(powers) < MIN_POWERS:
        steps = [step * 10.0**exponent for exponent in exponents for step in (1, 2, 5)]
        has_steps = sum(low <= step <= high for step in steps) > 1
        yield steps if has_steps else [*MaxNLocator(MIN_POWERS).tick_values(low, high)]
    for stride in range(1, len(powers) + 1):
        shown = powers[::stride]
        yield [*(-power for power in shown[::-1]), 0.0, *shown] if linear_limit else shown


def _have_space(axes: Axes, ticks: Sequence[float]) -> bool:
    """Return whether at least two labels fit next to each other."""
    points = np.column_stack([ticks, np.ones(len(ticks))])
    positions = (axes.transScale + axes.transLimits).transform(points)[:, 0]
    # The exact width of the panel is known after the layout.
    distances = np.diff(positions) * locate_panel(axes).width
    letters = np.array([len(format_tick(tick)) for tick in ticks])
    widths = (letters[1:] + letters[:-1]) / 2 * DIGIT_WIDTH * TEXT_SIZE
    return len(ticks) > 1 and bool(np.all(distances >= widths + LABEL_GAP * TEXT_SIZE))
