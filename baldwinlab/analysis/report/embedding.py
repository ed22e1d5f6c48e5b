"""Figures of a page: saved as files, and embedded in HTML."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

from matplotlib.figure import Figure as Drawing

from baldwinlab.analysis.figures.style import save_figure
from baldwinlab.analysis.report.replays import Link
from baldwinlab.analysis.statistics.csv import to_csv
from baldwinlab.core.file_writing import write_atomically

# Widths in inches, below which the page shows a figure narrower than the text.
NARROW_WIDTH: Final = 4.0
SLIM_WIDTH: Final = 6.0
BROAD_WIDTH: Final = 9.0


class ReportFigure(NamedTuple):
    """A figure with its caption and its data."""

    title: str
    caption: str
    # Alternative text for screen readers.
    alternative: str
    figure: Drawing
    # Rows of the figure's CSV file.
    table: Sequence[Mapping[str, Any]] = ()
    # Commands that compute the figure's data again, in the directory of the study.
    commands: Sequence[str] = ()
    # Lifetimes that the figure shows or summarizes.
    links: Sequence[Link] = ()
    # Name of the files. The registry of the figures of a report sets it.
    name: str = ""
    is_setup: bool = False  # Whether the figure describes the model.


def save_and_inline(figure: ReportFigure, folder: Path) -> dict[str, Any]:
    """Save a figure as SVG, PNG and CSV, and return the values that a page needs to show it."""
    saved = save_figure(figure.figure, folder, figure.name)
    files = {"SVG": f"{figure.name}.svg", "PNG": f"{figure.name}.png"}
    if figure.table:
        files["CSV"] = f"{figure.name}.csv"
        columns = dict.fromkeys(column for row in figure.table for column in row)
        write_atomically(folder / files["CSV"], to_csv(list(columns), figure.table))
    return {
        "name": figure.name,
        "is_setup": figure.is_setup,
        "title": figure.title,
        "caption": figure.caption,
        "alternative": figure.alternative,
        "shape": _name_shape(figure.figure),
        "ratios": (saved.wide_ratio, saved.narrow_ratio),
        "source": f"data:image/svg+xml;base64,{b64encode(saved.image).decode('ascii')}",
        "files": files,
        "commands": figure.commands,
        "links": figure.links,
    }


def _name_shape(figure: Drawing) -> str:
    """Return the CSS classes of a figure, by its size."""
    width, height = figure.get_size_inches()
    if width < NARROW_WIDTH:
        return "narrow"
    classes = {"slim": width < SLIM_WIDTH, "broad": width > BROAD_WIDTH, "tall": height > width}
    return " ".join(name for name, applies in classes.items() if applies)
