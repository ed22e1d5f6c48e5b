"""Style of all figures, and functions that save them.

The colors are defined in `baldwinlab.analysis.palette`. Conditions also differ in line style and
marker, so that a gray print distinguishes them. Figures are 7.2 inches wide, and all text has one
size. The figures have the typeface and the frame of the charts in the lab: Inter, a title on the
left, axes at the left and at the bottom, and a pale grid.
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
from matplotlib import font_manager, style
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_pdf import FigureCanvasPdf
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from baldwinlab.analysis import typeface
from baldwinlab.analysis.figures.panels import (
    POINTS_PER_INCH,
    arrange_panels,
    merge_layouts,
    name_groups,
    rename_identifiers,
)
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
)
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.experiment.conditions import read_factors

__all__ = ["BLACK", "BLUE", "BROWN", "DARK_GRAY", "GRAY", "GREEN", "ORANGE", "PALE"]

# Width of a figure, in inches.
FIGURE_WIDTH = 7.2
# Largest number of letters in a line of a label.
LABEL_LETTERS = 30
# Largest number of letters in a line of a note, and the height of the line in inches.
NOTE_LETTERS = 112
NOTE_LINE_HEIGHT = 0.16
LINE_STYLES = ("-", "--", "-.", ":")
MARKERS = ("o", "s", "^", "D", "v", "P", "X")
# Multiples of the golden ratio, modulo 1, spread points evenly and reproducibly.
GOLDEN_RATIO = 0.618
# The default sizes of these texts are multiples of the size of the font.
TEXT_SIZES = (
    "axes.labelsize",
    "axes.titlesize",
    "figure.labelsize",
    "legend.fontsize",
    "xtick.labelsize",
    "ytick.labelsize",
)

MATPLOTLIB_SETTINGS: dict[str, Any] = {
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.edgecolor": GRAY,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titleweight": "bold",
    "figure.constrained_layout.use": True,
    # Matplotlib contains DejaVu Sans, which has the characters that Inter does not have here. Arial
    # has about the widths of Inter, for a reader of an SVG without these fonts.
    "font.family": [typeface.FAMILY, "sans-serif"],
    "font.sans-serif": ["DejaVu Sans", "Arial"],
    "font.size": typeface.TEXT_SIZE,
    **dict.fromkeys(TEXT_SIZES, typeface.TEXT_SIZE),
    "grid.color": PALE,
    "grid.linewidth": 0.75,
    "legend.frameon": False,
    # Text is text, which programs can search and edit.
    "svg.fonttype": "none",
    "pdf.fonttype": 42,
    # A label can be text of a part or of a paper, in which a dollar sign begins no formula.
    "text.parse_math": False,
    # Without a salt, identifiers in the SVG are random.
    "svg.hashsalt": "baldwinlab",
    "xtick.color": GRAY,
    "xtick.labelcolor": BLACK,
    "ytick.color": GRAY,
    "ytick.labelcolor": BLACK,
}
for _name in typeface.CSS_WEIGHTS:
    font_manager.fontManager.addfont(typeface.FOLDER / f"{_name}.ttf")

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
    learners = dict.fromkeys(levels.learner for levels in factors.values())
    styles = {learner: choose_style(index) for index, learner in enumerate(learners)}
    return [
        PlottedCondition(name, levels.learner, levels.map, styles[levels.learner])
        for name, levels in factors.items()
    ]


def group_by_map(dataset: xr.Dataset) -> dict[str, list[PlottedCondition]]:
    """Return the conditions of each map, in the order of the study."""
    groups: dict[str, list[PlottedCondition]] = {}
    for condition in style_conditions(dataset):
        groups.setdefault(condition.map_name, []).append(condition)
    return groups


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
def to_png(figure: Figure, software: str | None = None) -> bytes:
    """Render a figure as PNG. `software`: mark of the program that wrote the file."""
    page = io.BytesIO()
    figure.set_dpi(200)
    canvas = FigureCanvasAgg(figure)
    canvas.print_png(page, metadata={"Software": software})  # type: ignore[no-untyped-call]
    return page.getvalue()


@styled
def _to_pdf(figure: Figure) -> bytes:
    page = io.BytesIO()
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
    figure.supxlabel("\n".join(lines), x=0.01, ha="left", color=DARK_GRAY)
    if file_format == "pdf":
        # The resolution of images in the PDF.
        figure.set_dpi(200)
        return _to_pdf(figure)
    return to_svg(figure) if file_format == "svg" else to_png(figure)


class LayoutSize(NamedTuple):
    """The size of a layout, in points, and the smallest scale of a panel in the layout."""

    width: float
    height: float
    scale: float = 1.0

    @property
    def ratio(self) -> float:
        """Width by height."""
        return self.width / self.height

    @property
    def min_width(self) -> float:
        """The width in CSS pixels at which text has the smallest size on a screen."""
        return self.width * typeface.MIN_PIXELS / (typeface.TEXT_SIZE * self.scale)


class SavedFigure(NamedTuple):
    """The image of a figure for a page, as an SVG element, and the sizes of both layouts."""

    image: str
    wide: LayoutSize
    narrow: LayoutSize


def save_figure(figure: Figure, folder: Path, name: str) -> SavedFigure:
    """Write a figure as SVG, PDF and PNG.

    `folder`: the folder of the files, which are written atomically. `name`: the name of the files
    without a suffix. Returns the image for a page, which shows one panel per row in a narrow space.
    """
    name_groups(figure)
    drawing = to_svg(figure)
    # The layout uses positions that the next drawing changes.
    layout = arrange_panels(figure)
    # The layout is used again, because a new layout takes longer than drawing.
    figure.set_layout_engine("none")
    write_atomically(folder / f"{name}.svg", drawing)
    write_atomically(folder / f"{name}.pdf", _to_pdf(figure))
    write_atomically(folder / f"{name}.png", to_png(figure))
    wide = LayoutSize(*(figure.get_size_inches() * POINTS_PER_INCH).tolist())
    # A page is no XML document.
    element = drawing[drawing.index(b"<svg") :].decode()
    if layout is None:
        return SavedFigure(rename_identifiers(element, name), wide, wide)
    image = rename_identifiers(merge_layouts(element, figure, layout), name)
    smallest_scale = min(piece.scale for piece in layout.pieces)
    return SavedFigure(image, wide, LayoutSize(layout.width, layout.height, smallest_scale))
