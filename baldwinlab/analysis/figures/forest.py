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

    @property
    def marks(self) -> dict[str, Any]:
        """The properties of a line with markers."""
        return {
            "color": self.color,
            "marker": self.marker,
            "ms": self.size,
            "mfc": self.face or self.color,
        }


def draw_estimates(
    axes: Axes,
    positions: npt.ArrayLike,
    estimates: npt.ArrayLike,
    style: EstimateStyle,
    *,
    is_horizontal: bool = False,
    is_joined: bool = False,
) -> None:
    """Draw estimates with their intervals at positions. NaN is not drawn.

    `estimates`: estimate, low and high end of the interval, each for one or more positions.
    `is_horizontal`: whether the values have the horizontal axis. `is_joined`: whether a line joins
    the estimates.
    """
    centers, low, high = np.asarray(estimates, np.float64)
    draw_intervals = axes.hlines if is_horizontal else axes.vlines
    draw_intervals(positions, low, high, color=style.color, lw=style.width)
    x, y = (centers, positions) if is_horizontal else (positions, centers)
    axes.plot(x, y, ls="-" if is_joined else "none", lw=1.5, clip_on=False, **style.marks)
