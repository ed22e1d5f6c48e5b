"""Curves: lines with bands, axes that start at 0, logarithmic axes, and legends of lines.

The ticks of a logarithmic axis are numbers without exponents, which would be too small to read.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from baldwinlab.analysis.figures.panels import locate_panel
from baldwinlab.analysis.figures.style import FIGURE_WIDTH, SeriesStyle
from baldwinlab.analysis.statistics.intervals import CurveInterval
from baldwinlab.analysis.typeface import TEXT_SIZE

# Smallest number of markers on a long curve, which has less than twice this number.
MAX_MARKERS: Final = 8
# Largest number of columns of a legend, and the width of a line and the gaps, in letters.
MAX_LEGEND_COLUMNS: Final = 4
LEGEND_LINE_LETTERS: Final = 8
# Length of a label, in inches per letter.
LETTER_INCHES: Final = 0.075
# Smaller and larger numbers are not written with all digits.
PLAIN_NUMBERS: Final = (1e-4, 1e6)
LARGE_UNITS: Final = {"billion": 1e9, "million": 1e6}
# Mean width of a digit, and smallest distance between two labels, in font sizes.
DIGIT_WIDTH: Final = 0.62
LABEL_GAP: Final = 0.8
# With fewer powers of ten, the labels also have 2 and 5 times the powers.
MIN_POWERS: Final = 3


def make_panels(
    n_panels: int, max_columns: int, panel_height: float, margin: float, **options: Any
) -> tuple[Figure, npt.NDArray[Any]]:
    """Return a figure and its panels [row, column]. Panels after `n_panels` are removed.

    `panel_height` and `margin` are in inches. `margin` is the height of all legends. `options` are
    arguments of `Figure.subplots`.
    """
    n_columns = min(max_columns, max(n_panels, 1))
    n_rows = math.ceil(max(n_panels, 1) / n_columns)
    figure = Figure((FIGURE_WIDTH, margin + panel_height * n_rows))
    grid = figure.subplots(n_rows, n_columns, squeeze=False, **options)
    for axes in grid.flat[n_panels:]:
        axes.remove()
    return figure, grid


def make_blocks(
    titles: Sequence[str], n_rows: int, row_height: float
) -> tuple[Figure, npt.NDArray[Any]]:
    """Return a figure and its panels [condition, row], in two columns of conditions."""
    n_columns = min(len(titles), 2)
    # A block has all rows of two conditions that are next to each other.
    n_blocks = math.ceil(len(titles) / n_columns)
    figure = Figure((FIGURE_WIDTH, 0.6 + row_height * n_rows * n_blocks))
    grid = figure.subplots(n_blocks * n_rows, n_columns, squeeze=False)
    # From [block and row, column] to [condition, row].
    panels = grid.reshape(n_blocks, n_rows, n_columns).transpose(0, 2, 1).reshape(-1, n_rows)
    # An odd number of conditions leaves the last panels unused.
    for axes in panels[len(titles) :].flat:
        axes.set_visible(False)
    for axes, title in zip(panels[:, 0], titles, strict=False):
        axes.set_title(title)
    return figure, panels[: len(titles)]


def label_blocks(panels: npt.NDArray[Any], *labels: str) -> None:
    """Label the rows of `make_blocks` at the left edge."""
    # Two conditions are next to each other, so every second condition is in the left column.
    for column in panels[::2]:
        for axes, label in zip(column, labels, strict=True):
            axes.set_ylabel(label)


def draw_line(
    axes: Axes,
    x: npt.ArrayLike,
    y: npt.ArrayLike,
    style: SeriesStyle,
    label: str = "",
    *,
    is_stepped: bool = False,
) -> None:
    """Draw a line with about `MAX_MARKERS` markers. `is_stepped` suits a distribution."""
    axes.plot(
        x,
        y,
        color=style.color,
        ls=style.line,
        lw=1.5,
        marker=style.marker,
        ms=3.5,
        markevery=max(1, np.size(x) // MAX_MARKERS),
        label=label,
        drawstyle="steps-post" if is_stepped else "default",
    )


def draw_curve(
    axes: Axes,
    interval: CurveInterval,
    style: SeriesStyle,
    label: str = "",
    dim: str = "generation",
) -> None:
    """Draw the center and the band of an interval along `dim`, or nothing if all are NaN."""
    center, low, high = (values[interval.center.notnull()] for values in interval)
    if center.size:
        axes.fill_between(center[dim], low, high, color=style.color, alpha=0.18, lw=0)
        draw_line(axes, center[dim], center, style, label)


def start_at_zero(axes: Axes) -> None:
    """Let the vertical axis start slightly below 0. Its top is 1 if no value is above 0."""
    top = find_top(axes)
    axes.set_ylim(-0.025 * top, top)


def find_top(axes: Axes) -> float:
    """Return the upper limit of a panel, or 1 if no value is above 0."""
    return axes.get_ylim()[1] if axes.dataLim.y1 > 0 else 1.0


def draw_legend(figure: Figure, styles: Mapping[str, SeriesStyle]) -> None:
    """Draw a legend of lines above a figure."""
    handles = [
        Line2D([], [], color=style.color, ls=style.line, marker=style.marker, ms=4, label=label)
        for label, style in styles.items()
    ]
    n_columns = count_legend_columns(styles)
    figure.legend(handles=handles, loc="outside upper center", ncols=n_columns)


def draw_legend_of_panels(
    figure: Figure, panels: Iterable[Axes], n_columns: int, *, is_below: bool = False
) -> None:
    """Draw a legend of the labels in panels above or below a figure, each label once."""
    handles: dict[str, Artist] = {}
    for axes in panels:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    figure.legend(
        handles=list(handles.values()),
        loc="outside lower center" if is_below else "outside upper center",
        ncols=n_columns,
    )


def count_legend_columns(labels: Iterable[str]) -> int:
    """Return the number of columns of a legend whose labels fit next to each other."""
    lengths = [len(label) for label in labels]
    letters = max(lengths, default=0) + LEGEND_LINE_LETTERS
    n_columns = int(FIGURE_WIDTH / (LETTER_INCHES * letters))
    return min(max(1, n_columns), MAX_LEGEND_COLUMNS, max(1, len(lengths)))


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
