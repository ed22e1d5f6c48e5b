"""How all figures look, and how they are kept.

Colours are those of `baldwinlab.analysis.figures.palette`; conditions differ in line and marker too, so that they survive a print in grey. Sizes
are those of a page: 7.2 inches wide, no text below 8 points.
"""

from __future__ import annotations

import io
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from threading import RLock
from typing import Any, NamedTuple, ParamSpec, TypeVar

from matplotlib import style
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from baldwinlab.analysis.figures.palette import (
    BLACK,
    BLUE,
    BROWN,
    DARK_GREY,
    GREEN,
    GREY,
    ORANGE,
    PALE,
    SERIES,
)
from baldwinlab.core.files import write_atomically

__all__ = ["BLACK", "BLUE", "BROWN", "DARK_GREY", "GREEN", "GREY", "ORANGE", "PALE"]

WIDTH = 7.2  # inches
LINES, MARKERS = ("-", "--", "-.", ":"), ("o", "s", "^", "D", "v", "P", "X")

SETTINGS: dict[str, Any] = {
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlesize": 9,
    "figure.constrained_layout.use": True,
    "font.family": "DejaVu Sans",  # comes with Matplotlib: the same shapes everywhere
    "font.size": 8.5,
    "grid.color": PALE,
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "svg.fonttype": "path",
    "svg.hashsalt": "baldwinlab",  # without it, identifiers in the SVG are drawn by lot
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
}

_settings = RLock()  # Matplotlib's settings belong to the whole process

Given = ParamSpec("Given")
Made = TypeVar("Made")


def styled(draw: Callable[Given, Made]) -> Callable[Given, Made]:
    """Draw with the settings of this house, whatever the process has set; one thread at a time."""

    @wraps(draw)
    def in_style(*args: Given.args, **kwargs: Given.kwargs) -> Made:
        with _settings, style.context(SETTINGS, after_reset=True):
            return draw(*args, **kwargs)

    return in_style


class Series(NamedTuple):
    """How a condition is drawn."""

    colour: str
    line: str
    marker: str


def series(number: int) -> Series:
    """The look of the `number`-th condition; the first 28 differ."""
    return Series(SERIES[number % 7], LINES[(number % 7 + number // 7) % 4], MARKERS[number % 7])


@styled
def svg(figure: Figure) -> bytes:
    """The same bytes each time for the same figure and version of Matplotlib."""
    page = io.BytesIO()
    figure.savefig(page, format="svg", dpi=150, metadata={"Date": None, "Creator": None})
    return page.getvalue()


@styled
def _png(figure: Figure) -> bytes:
    """As laid out already: to find a place for everything takes longer than to draw it."""
    page = io.BytesIO()
    figure.set_layout_engine("none")
    figure.set_dpi(200)
    FigureCanvasAgg(figure).print_png(page, metadata={"Software": None})  # type: ignore[no-untyped-call]
    return page.getvalue()


def save(figure: Figure, folder: Path, name: str) -> bytes:
    """Write `name`.svg and `name`.png, each whole or not at all, and return the SVG. Raises OSError."""
    drawing = svg(figure)
    write_atomically(folder / f"{name}.svg", drawing)
    write_atomically(folder / f"{name}.png", _png(figure))
    return drawing
