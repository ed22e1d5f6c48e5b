"""Labels at the right ends of lines, which a reader finds faster than the entries of a legend."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.optimize import isotonic_regression

from baldwinlab.analysis.figures.curves import draw_legend
from baldwinlab.analysis.figures.panels import LETTER_WIDTH, LINE_HEIGHT, locate_panel
from baldwinlab.analysis.figures.style import SeriesStyle
from baldwinlab.analysis.typeface import TEXT_SIZE

# More lines in a panel have a legend.
MAX_LABELS: Final = 6
# Largest number of letters in a line of a label.
LINE_LETTERS: Final = 13
# Smallest width of a panel without its labels, in points.
MIN_PANEL_WIDTH: Final = 100.0
# All lines of a panel must end in this fraction of the panel, at the right.
MAX_END_DISTANCE: Final = 0.2
# Distances from the right edge of a panel to the labels, and between labels, in points.
EDGE_GAP: Final = 8.0
LABEL_GAP: Final = 4.0
# A label can be broken after these characters.
BREAKS: Final = re.compile(r"(?<=[ +])")


class LineEnd(NamedTuple):
    """The right end of a line, and its label."""

    point: tuple[float, float]  # In data coordinates.
    x: float  # In points, from the lower left corner of the panel.
    y: float
    label: str
    color: str

    @property
    def label_height(self) -> float:
        """Height of the label and the gap in points."""
        return LINE_HEIGHT * TEXT_SIZE * (self.label.count("\n") + 1) + LABEL_GAP

    @property
    def label_width(self) -> float:
        """About the width of the label in points."""
        return LETTER_WIDTH * TEXT_SIZE * max(map(len, self.label.split("\n")))


def label_lines(figure: Figure, styles: Mapping[str, SeriesStyle]) -> None:
    """Label the lines of all panels at their right ends, or draw a legend if a label has no space.

    `styles`: the styles of the lines by label. The limits of the panels must be final.
    """
    ends = {axes: _find_ends(axes, styles) for axes in figure.axes}
    if all(_have_space(*panel) for panel in ends.items()):
        for axes, panel_ends in ends.items():
            _draw_labels(axes, panel_ends)
    else:
        draw_legend(figure, styles)


def _find_ends(axes: Axes, labels: Collection[str]) -> list[LineEnd]:
    """Return the right ends of the lines with one of the labels, from the lowest."""
    # The limits of a panel are otherwise computed with the layout.
    axes.autoscale_view()
    box = locate_panel(axes)
    ends = []
    for line in axes.lines:
        points = np.asarray(line.get_xydata(), np.float64)
        points = points[np.isfinite(points).all(axis=1)]
        if line.get_label() in labels and len(points):
            x, y = (axes.transScale + axes.transLimits).transform(points[-1])
            ends.append(
                LineEnd(
                    point=(points[-1, 0], points[-1, 1]),
                    x=x * box.width,
                    y=y * box.height,
                    label=_wrap(str(line.get_label())),
                    color=str(line.get_color()),
                )
            )
    # Of lines with equal ends, the first has the upper label.
    return sorted(ends, key=lambda end: -end.y)[::-1]


def _wrap(label: str) -> str:
    """Break a label into lines, for example after the "+" in "evo+self-taught"."""
    first, *words = BREAKS.split(label)
    lines = [first]
    for word in words:
        if len(lines[-1] + word.rstrip()) <= LINE_LETTERS:
            lines[-1] += word
        else:
            lines.append(word)
    return "\n".join(line.rstrip() for line in lines)


def _have_space(axes: Axes, ends: Sequence[LineEnd]) -> bool:
    box = locate_panel(axes)
    return (
        len(ends) <= MAX_LABELS
        and sum(end.label_height for end in ends) <= box.height
        and all(box.width - end.label_width >= MIN_PANEL_WIDTH for end in ends)
        and all(end.x >= (1 - MAX_END_DISTANCE) * box.width for end in ends)
    )


def _draw_labels(axes: Axes, ends: Sequence[LineEnd]) -> None:
    box = locate_panel(axes)
    for end, y in zip(ends, _spread(ends, box.height), strict=True):
        axes.annotate(
            end.label,
            end.point,
            # The layout changes the size of the panel, but hardly the distances to the end.
            (box.width - end.x + EDGE_GAP, y - end.y),
            textcoords="offset points",
            va="center",
            annotation_clip=False,
            arrowprops={
                "arrowstyle": "-",
                "color": end.color,
                "relpos": (0, 0.5),
                "shrinkA": 2,
                "shrinkB": 0,
            },
        )


def _spread(ends: Sequence[LineEnd], height: float) -> np.ndarray:
    """Return heights of labels in a panel, close to the ends of the lines and without overlaps."""
    if not ends:
        return np.empty(0)
    heights = np.array([end.label_height for end in ends])
    # The center of each label above the center of the lowest label, without gaps.
    stacked = np.cumsum(heights) - (heights + heights[0]) / 2
    free = np.array([end.y for end in ends]) - stacked
    lowest, highest = heights[0] / 2, height - stacked[-1] - heights[-1] / 2
    return np.asarray(isotonic_regression(free).x.clip(lowest, highest) + stacked)
