"""Charts: strips and boxes of values, estimates with their intervals, and tables of cells."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.colors import Colormap, LinearSegmentedColormap
from matplotlib.image import AxesImage

from baldwinlab.analysis.figures.style import BLACK, BLUE, SeriesStyle, spread_points
from baldwinlab.analysis.palette import CELL_TEXT, choose_text_color

BOXES_NOTE: Final = (
    "Each point is a run. The box shows the quartiles, and its thick line the median. Whiskers "
    "extend to the most distant run within 1.5 times the interquartile range."
)
# Widths of a box, of the points in a box, and of the points of a strip. Groups have the distance 1.
BOX_WIDTH: Final = 0.55
BOX_SPREAD: Final = 0.36
STRIP_SPREAD: Final = 0.5
# Half of the length of the line of a median.
HALF_MEDIAN_LINE: Final = 0.36
# People with any color vision can read cividis: J. R. Nuñez, C. R. Anderton and R. S. Renslow, PLOS
# ONE 13 (2018).
CIVIDIS: Final = "cividis"
WHITE_TO_BLUE: Final = LinearSegmentedColormap.from_list("white to blue", ["white", BLUE])


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
        showfliers=False,  # Each run is drawn as a point below.
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
    centers, low, high = np.asarray(estimates, np.float64)  # [position] each, or numbers.
    draw_intervals = axes.hlines if is_horizontal else axes.vlines
    draw_intervals(positions, low, high, color=style.color, lw=style.width)
    x, y = (centers, positions) if is_horizontal else (positions, centers)
    axes.plot(x, y, ls="-" if is_joined else "none", lw=1.5, clip_on=False, **style.marks)


def draw_cells(
    axes: Axes,
    values: npt.NDArray[np.float64],
    texts: npt.ArrayLike,
    colormap: str | Colormap = CIVIDIS,
    limits: tuple[float, float] = (0, 1),
    *,
    is_upward: bool = False,
) -> AxesImage:
    """Draw values [row, column] as colored cells with texts. A cell of NaN has no color.

    `limits`: the values of the first and of the last color. `is_upward`: whether the first row is
    at the bottom, as on an axis.
    """
    image = axes.imshow(
        values,
        colormap,
        vmin=limits[0],
        vmax=limits[1],
        aspect="auto",
        origin="lower" if is_upward else "upper",
    )
    colors = np.asarray(image.to_rgba(np.ma.masked_invalid(values)))
    opacities = colors[..., 3:]
    # The colors on white, [row, column, (red, green, blue)].
    backgrounds = opacities * colors[..., :3] + 1 - opacities
    for (row, column), text in np.ndenumerate(np.asarray(texts, str)):
        color = CELL_TEXT[choose_text_color(backgrounds[row, column].tolist())]
        axes.text(column, row, str(text), ha="center", va="center", color=color)
    axes.grid(visible=False)
    return image


def label_cells(axes: Axes, rows: Sequence[object], columns: Sequence[object]) -> None:
    """Label the rows and the columns of cells, without frame and ticks."""
    axes.set_xticks(range(len(columns)), [str(label) for label in columns])
    axes.set_yticks(range(len(rows)), [str(label) for label in rows])
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
