"""Forest plots: estimates with their intervals."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes


class EstimateStyle(NamedTuple):
    """The marks of estimates."""

    color: str
    marker: str = "o"
    face: str = ""  # Color of the inside of a marker, by default `color`.
    size: float = 4
    width: float = 1.1  # Width of the line of an interval, in points.


def draw_estimates(
    axes: Axes,
    positions: npt.ArrayLike,
    estimates: npt.ArrayLike,
    low: npt.ArrayLike,
    high: npt.ArrayLike,
    style: EstimateStyle,
    *,
    is_horizontal: bool = False,
    is_joined: bool = False,
) -> None:
    """Draw estimates with their intervals at positions. NaN is not drawn.

    `is_horizontal`: whether the values have the horizontal axis. `is_joined`: whether a line joins
    the estimates.
    """
    positions, estimates = np.atleast_1d(positions), np.atleast_1d(estimates)
    draw_intervals = axes.hlines if is_horizontal else axes.vlines
    draw_intervals(positions, low, high, color=style.color, lw=style.width)
    marks: dict[str, Any] = {
        "marker": style.marker,
        "ms": style.size,
        "mec": style.color,
        "mfc": style.face or style.color,
        "clip_on": False,
    }
    x, y = (estimates, positions) if is_horizontal else (positions, estimates)
    axes.plot(x, y, color=style.color, ls="-" if is_joined else "none", lw=1.5, **marks)
