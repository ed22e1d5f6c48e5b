"""Strips: the values of groups as points, with their median or as box plots."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes

from baldwinlab.analysis.figures.style import BLACK, SeriesStyle, spread_points

BOXES_NOTE: Final = (
    "Each point is a run. The box shows the quartiles, and its thick line the median. Whiskers "
    "extend to the most distant run within 1.5 times the interquartile range."
)
# Widths of a box, of its points, and of the points of a strip, if the distance of groups is 1.
BOX_WIDTH: Final = 0.55
BOX_SPREAD: Final = 0.36
STRIP_SPREAD: Final = 0.5
# Half of the length of the line of a median.
HALF_MEDIAN_LINE: Final = 0.36


def draw_strip(
    axes: Axes, position: float, sample: npt.NDArray[np.float64], color: str, size: float = 3.2
) -> None:
    """Draw the values of a group along a row, and a line at their median."""
    heights = position + STRIP_SPREAD * spread_points(sample.size)
    axes.plot(sample, heights, "o", color=color, ms=size, alpha=0.6, mew=0)
    ends = [position - HALF_MEDIAN_LINE, position + HALF_MEDIAN_LINE]
    axes.plot([float(np.median(sample))] * 2, ends, color=BLACK, lw=1.6)


def label_strips(axes: Axes, labels: list[str]) -> None:
    """Label the rows of strips. The first row is at the top."""
    axes.set_yticks(range(len(labels)), labels)
    axes.set_ylim(len(labels) - 0.5, -0.5)


def draw_box(axes: Axes, position: int, sample: np.ndarray, style: SeriesStyle) -> None:
    """Draw a box plot, and a point per run."""
    line = {"color": style.color, "linewidth": 1.1}
    axes.boxplot(
        [sample],
        positions=[position],
        widths=BOX_WIDTH,
        showfliers=False,
        manage_ticks=False,
        boxprops=line,
        whiskerprops=line,
        capprops=line,
        medianprops=line | {"linewidth": 2.2},
    )
    offsets = BOX_SPREAD * spread_points(sample.size)
    axes.plot(
        position + offsets,
        sample,
        style.marker,
        color=style.color,
        ms=3.2,
        alpha=0.6,
        mew=0,
        clip_on=False,
    )
