"""Figures of the report. Each module of this package declares a figure with the module's name.

The names are listed without an import of the modules, because these imports load Matplotlib.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from importlib import import_module
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Final, NamedTuple

from baldwinlab.analysis.report.content import select_foragers
from baldwinlab.analysis.report.data import ReportData, link_conditions
from baldwinlab.core.names import suggest
from baldwinlab.papers import Paper, PaperError
from baldwinlab.papers.paper import DEFAULT_FIGURES

if TYPE_CHECKING:
    from baldwinlab.analysis.report.sections import ReportFigure

DrawFunction = Callable[[ReportData], "ReportFigure | None"]


class DeclaredFigure(NamedTuple):
    """A figure of the report, declared by `declare_figure`."""

    name: str  # Name in `paper.toml`, and of the files.
    draw: DrawFunction  # Returns None if a study has no data for the figure.
    is_setup: bool  # Whether the figure describes the model, in the section on the setup.
    needs_world: bool  # Whether the text that papers add to the caption describes MiniWorld.


_declared: Final[dict[str, DeclaredFigure]] = {}


def declare_figure(
    *, is_setup: bool = False, needs_world: bool = False
) -> Callable[[DrawFunction], DrawFunction]:
    """Declare that the decorated function draws the figure with the name of its module."""

    def declare(draw: DrawFunction) -> DrawFunction:
        name = _name_figure(draw.__module__.rpartition(".")[2])
        _declared[name] = DeclaredFigure(name, draw, is_setup, needs_world)
        return draw

    return declare


def list_figures() -> list[str]:
    """Return the names of all figures."""
    return sorted(_name_figure(module.name) for module in iter_modules(__path__))


def _name_figure(module: str) -> str:
    return module.replace("_", "-")


def load_figure(name: str) -> DeclaredFigure:
    """Import the module of a figure, which declares the figure, and return the figure."""
    import_module(f"{__name__}.{name.replace('-', '_')}")
    return _declared[name]


def check_figures(paper: Paper) -> None:
    """Raise PaperError if a paper names a figure that does not exist."""
    names = list_figures()
    used: Iterable[tuple[str, Iterable[str]]] = (
        ("paper.toml: figures", paper.metadata.figures),
        ("words.toml: captions", paper.texts.captions),
    )
    for place, figures in used:
        for name in figures:
            if name not in names:
                problem = f"{name!r}, which does not exist{suggest(name, names)}"
                raise PaperError(f"{paper.folder}/{place} {problem}")


def draw_figures(report: ReportData) -> Iterator[ReportFigure]:
    """Draw the figures that the paper of a report names, or without a paper `DEFAULT_FIGURES`."""
    names = report.paper.metadata.figures if report.paper else DEFAULT_FIGURES
    captions = report.paper.texts.captions if report.paper else {}
    has_world = bool(select_foragers(report.experiments))
    condition_links = link_conditions(report.lives)
    for figure in map(load_figure, names):
        drawn = figure.draw(report)
        if drawn:
            is_caption_valid = has_world or not figure.needs_world
            addition = captions.get(figure.name, "") if is_caption_valid else ""
            # Figures of results without links get links to typical lifetimes.
            links = drawn.links if drawn.links or figure.is_setup else condition_links
            yield drawn._replace(
                name=figure.name,
                caption=f"{drawn.caption} {addition}".rstrip(),
                links=links,
                is_setup=figure.is_setup,
            )
