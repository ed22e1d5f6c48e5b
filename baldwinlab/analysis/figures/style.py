"""Style of all figures, and functions that save them.

The colors are defined in `baldwinlab.analysis.palette`. Conditions also differ in line style and
marker, so that a gray print distinguishes them. Figures are 7.2 inches wide, and no text
is smaller than 8 points.
"""

from __future__ import annotations

import io
import textwrap
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from threading import RLock
from typing import Any, NamedTuple, ParamSpec, TypeVar

import numpy as np
import xarray as xr
from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_pdf import FigureCanvasPdf
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from baldwinlab.analysis.figures.panels import arrange_panels, merge_layouts, name_groups
from baldwinlab.analysis.palette import (
    BLACK,
    BLUE,
    BROWN,
    DARK_GRAY,
    GRAY,
    GREEN,
    ORANGE,
    PALE,
    SERIES_COLORS,
    figure_css,
)
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.experiment.conditions import read_factors

__all__ = ["BLACK", "BLUE", "BROWN", "DARK_GRAY", "GRAY", "GREEN", "ORANGE", "PALE"]

# Width of a figure, in inches.
FIGURE_WIDTH = 7.2
# Largest number of letters in a line of a label.
LABEL_LETTERS = 30
# Largest number of letters in a line of a note, and the height of the line in inches.
NOTE_LETTERS = 105
NOTE_LINE_HEIGHT = 0.16
LINE_STYLES = ("-", "--", "-.", ":")
MARKERS = ("o", "s", "^", "D", "v", "P", "X")
# Multiples of the golden ratio, modulo 1, spread points evenly and reproducibly.
GOLDEN_RATIO = 0.618

MATPLOTLIB_SETTINGS: dict[str, Any] = {
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlesize": 9,
    "figure.constrained_layout.use": True,
    # Matplotlib contains DejaVu Sans, which has a free license. Verdana has about its widths, for a
    # reader of an SVG without it.
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans", "Verdana"],
    "font.size": 8.5,
    "grid.color": PALE,
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    # Text is text, which programs can search and edit.
    "svg.fonttype": "none",
    "pdf.fonttype": 42,
    # Without a salt, identifiers in the SVG are random.
    "svg.hashsalt": "baldwinlab",
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
}

# Matplotlib has one set of settings per process.
_settings_lock = RLock()

Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")


def styled(draw: Callable[Parameters, Result]) -> Callable[Parameters, Result]:
    """Make a function draw with `MATPLOTLIB_SETTINGS` only, in one thread at a time."""

    @wraps(draw)
    def draw_styled(*args: Parameters.args, **kwargs: Parameters.kwargs) -> Result:
        with _settings_lock, style.context(MATPLOTLIB_SETTINGS, after_reset=True):
            return draw(*args, **kwargs)

    return draw_styled


class SeriesStyle(NamedTuple):
    """The color, line and marker of a condition."""

    color: str
    line: str
    marker: str


def choose_style(series_index: int) -> SeriesStyle:
    """Return the style of a condition by its index. The first 28 styles differ."""
    round_index, color_index = divmod(series_index, len(SERIES_COLORS))
    # Each reuse of a color has another line style.
    line_index = (color_index + round_index) % len(LINE_STYLES)
    return SeriesStyle(SERIES_COLORS[color_index], LINE_STYLES[line_index], MARKERS[color_index])


class PlottedCondition(NamedTuple):
    """A condition, its factors and its style."""

    name: str
    learner: str
    map_name: str
    style: SeriesStyle


def style_conditions(dataset: xr.Dataset) -> list[PlottedCondition]:
    """Return the conditions in the order of the study. A learner has one style on all maps."""
    factors = read_factors(dataset)
    learners = list(dict.fromkeys(levels.learner for levels in factors.values()))
    return [
        PlottedCondition(
            name=name,
            learner=levels.learner,
            map_name=levels.map,
            style=choose_style(learners.index(levels.learner)),
        )
        for name, levels in factors.items()
    ]


def wrap_label(label: str) -> str:
    """Return the label of an axis in lines that fit next to a panel."""
    return textwrap.fill(label, LABEL_LETTERS)


def label_generations(axes: Axes) -> None:
    """Label the horizontal axis with whole generations."""
    axes.set_xlabel("generation")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, steps=[1, 2, 5, 10], min_n_ticks=1))


def spread_points(n_points: int) -> np.ndarray:
    """Return offsets from -0.5 to 0.5, which keep points with equal values apart."""
    fractions = np.arange(n_points) * GOLDEN_RATIO % 1
    return np.asarray(fractions - 0.5)


@styled
def to_svg(figure: Figure) -> bytes:
    """Render a figure as SVG, deterministically for a version of Matplotlib."""
    page = io.BytesIO()
    # The resolution of images in the SVG.
    figure.set_dpi(150)
    # `Figure.savefig` would draw the figure twice: for the layout, and for the file.
    metadata = {"Date": None, "Creator": None}
    FigureCanvasSVG(figure).print_svg(page, metadata=metadata)  # type: ignore[no-untyped-call]
    return page.getvalue()


@styled
def _to_png(figure: Figure) -> bytes:
    page = io.BytesIO()
    # The layout of the SVG is used again, because a new layout takes longer than drawing.
    figure.set_layout_engine("none")
    figure.set_dpi(200)
    FigureCanvasAgg(figure).print_png(page, metadata={"Software": None})  # type: ignore[no-untyped-call]
    return page.getvalue()


@styled
def _to_pdf(figure: Figure) -> bytes:
    page = io.BytesIO()
    figure.set_layout_engine("none")
    metadata = {"CreationDate": None, "Creator": None, "Producer": None}
    FigureCanvasPdf(figure).print_pdf(page, metadata=metadata)  # type: ignore[no-untyped-call]
    return page.getvalue()


@styled
def render_figure(figure: Figure, file_format: str, note: str) -> bytes:
    """Render a figure as a file, with a note below the panels that explains the figure.

    `figure`: a figure that was not rendered yet. `file_format`: "svg", "pdf" or "png".
    """
    lines = textwrap.wrap(note, NOTE_LETTERS)
    width, height = figure.get_size_inches()
    figure.set_size_inches(width, height + NOTE_LINE_HEIGHT * len(lines))
    figure.supxlabel("\n".join(lines), x=0.01, ha="left", fontsize=8, color=DARK_GRAY)
    if file_format == "svg":
        return to_svg(figure)
    figure.set_dpi(200)
    page = io.BytesIO()
    if file_format == "pdf":
        metadata = {"CreationDate": None, "Creator": None, "Producer": None}
        FigureCanvasPdf(figure).print_pdf(page, metadata=metadata)  # type: ignore[no-untyped-call]
    else:
        FigureCanvasAgg(figure).print_png(page, metadata={"Software": None})  # type: ignore[no-untyped-call]
    return page.getvalue()


class SavedFigure(NamedTuple):
    """The image of a figure for a page. The ratios are width by height of both layouts."""

    image: bytes
    wide_ratio: float
    narrow_ratio: float


def save_figure(figure: Figure, folder: Path, name: str) -> SavedFigure:
    """Write a figure as SVG, PDF and PNG.

    `folder`: the folder of the files, which are written atomically. `name`: the name of the files
    without a suffix. Returns the image for a page: an SVG that shows one panel per row in a narrow
    space.
    """
    name_groups(figure)
    drawing = to_svg(figure)
    # The layout uses positions that the next drawing changes.
    layout = arrange_panels(figure)
    write_atomically(folder / f"{name}.svg", drawing)
    write_atomically(folder / f"{name}.pdf", _to_pdf(figure))
    write_atomically(folder / f"{name}.png", _to_png(figure))
    width, height = figure.get_size_inches()
    wide_ratio = float(width / height)
    if layout is None:
        return SavedFigure(add_dark_colors(drawing), wide_ratio, wide_ratio)
    image = add_dark_colors(merge_layouts(drawing, figure, layout))
    return SavedFigure(image, wide_ratio, layout.width / layout.height)


def add_dark_colors(image: bytes) -> bytes:
    """Return an SVG that has the colors of a dark page on a dark screen."""
    head, separator, rest = image.partition(b"<metadata>")
    return head + f"<style>{figure_css()}</style>".encode() + separator + rest
