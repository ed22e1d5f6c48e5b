"""Small files in place of figures, for tests of pages. Other tests draw the figures."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final
from unittest.mock import patch

from matplotlib.figure import Figure

from baldwinlab.analysis.figures.style import LayoutSize, SavedFigure
from baldwinlab.core.file_writing import write_atomically

SVG: Final = b'<svg xmlns="http://www.w3.org/2000/svg" width="1" height="1"/>'


def save_placeholder(figure: Figure, folder: Path, name: str) -> SavedFigure:
    """Write small files with the names of the files of a figure."""
    for suffix in (".svg", ".pdf", ".png"):
        write_atomically(folder / f"{name}{suffix}", SVG)
    return SavedFigure(SVG.decode(), LayoutSize(1, 1), LayoutSize(1, 1))


@contextmanager
def save_placeholders() -> Iterator[None]:
    """Save placeholders until the block ends. Rendering takes most of the time of a report."""
    with patch("baldwinlab.analysis.report.sections.save_figure", save_placeholder):
        yield
