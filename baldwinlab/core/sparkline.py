"""A curve as one line of text, and the curve of a study that runs."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from typing import Final

BARS: Final = "▁▂▃▄▅▆▇█"
# Width of the curve of a study, in characters.
CURVE_WIDTH: Final = 20
# Seconds without a new value after which the line shows another condition.
MAX_SILENCE: Final = 2.0


def draw_sparkline(values: Sequence[float], width: int) -> str:
    """Return a line of bars. A bar is the mean of neighboring values.

    `values`: NaN is a gap. The lowest bar is 0, or the lowest value below 0.
    """
    n_bars = min(width, len(values))
    means = []
    for bar in range(n_bars):
        group = values[bar * len(values) // n_bars : (bar + 1) * len(values) // n_bars]
        finite = [value for value in group if math.isfinite(value)]
        means.append(sum(finite) / len(finite) if finite else math.nan)
    finite_means = [mean for mean in means if math.isfinite(mean)]
    low = min([0.0, *finite_means])
    high = max([0.0, *finite_means])
    return "".join(_choose_bar(mean, low, high) for mean in means)


def _choose_bar(value: float, low: float, high: float) -> str:
    if not math.isfinite(value):
        return " "
    share = (value - low) / (high - low) if high > low else 0.0
    return BARS[min(int(share * len(BARS)), len(BARS) - 1)]


class FitnessCurves:
    """Mean fitness by generation of the conditions of a study that runs, as one line of text."""

    def __init__(self) -> None:
        # Sum and number of values by generation, by condition.
        self._sums: dict[str, dict[int, tuple[float, int]]] = {}
        self._shown = ""
        self._shown_at = -math.inf

    def add(self, condition: str, generation: int, fitness: float) -> None:
        """Add the mean fitness of a finished generation of a run."""
        now = time.monotonic()
        # Tasks run in parallel, so values of several conditions alternate.
        if condition == self._shown or now - self._shown_at > MAX_SILENCE:
            self._shown = condition
            self._shown_at = now
        sums = self._sums.setdefault(condition, {})
        total, number = sums.get(generation, (0.0, 0))
        sums[generation] = (total + fitness, number + 1)

    def __str__(self) -> str:
        """Return condition, curve and last value, such as "evo/A ▁▃▆█ 42.7"."""
        sums = dict(self._sums.get(self._shown, {}))
        if not sums:
            return ""
        means = [total / number for _, (total, number) in sorted(sums.items())]
        return f"{self._shown} {draw_sparkline(means, CURVE_WIDTH)} {means[-1]:.3g}"
