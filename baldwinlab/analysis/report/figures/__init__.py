"""Figures of the report, which the modules of this package draw.

The figures are listed without an import of the modules, because these imports load Matplotlib.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from importlib import import_module
from typing import TYPE_CHECKING, Final, NamedTuple

from baldwinlab.analysis.report.content import select_foragers
from baldwinlab.analysis.report.data import ReportData, link_conditions
from baldwinlab.core.names import suggest
from baldwinlab.papers import Paper, PaperError
from baldwinlab.papers.paper import DEFAULT_FIGURES

if TYPE_CHECKING:
    from baldwinlab.analysis.report.sections import ReportFigure

DrawFunction = Callable[[ReportData], "ReportFigure | None"]


class FigureKind(NamedTuple):
    """A figure of the report."""

    function: str  # "MODULE.FUNCTION". It returns None if a study has no data for the figure.
    is_setup: bool = False  # Whether the figure describes the model, in the section on the setup.
    needs_world: bool = False  # Whether the text that papers add describes MiniWorld.


FIGURES: Final[Mapping[str, FigureKind]] = {
    "clocks": FigureKind("fitness.draw_evaluations_figure"),
    "emergence": FigureKind("emergence.draw_figure", needs_world=True),
    "final-fitness": FigureKind("boxes.draw_figure", needs_world=True),
    "fitness": FigureKind("fitness.draw_figure", needs_world=True),
    "maps": FigureKind("maps.draw_figure", is_setup=True, needs_world=True),
    "measures": FigureKind("boxes.draw_measures_figure"),
    "networks": FigureKind("networks.draw_figure", is_setup=True, needs_world=True),
    "senses": FigureKind("senses.draw_figure", is_setup=True, needs_world=True),
    "shares": FigureKind("shares.draw_figure"),
    "species": FigureKind("shares.draw_species_figure"),
    "survival": FigureKind("fitness.draw_survival_figure"),
}
"""The figures by their name in `paper.toml`, which is also the name of the files."""


def load_figure(name: str) -> DrawFunction:
    """Import the module of a figure, and return the function that draws the figure."""
    module, function = FIGURES[name].function.split(".")
    draw: DrawFunction = getattr(import_module(f"{__name__}.{module}"), function)
    return draw


def check_figures(paper: Paper) -> None:
    """Raise PaperError if a paper names a figure that does not exist."""
    used: Iterable[tuple[str, Iterable[str]]] = (
        ("paper.toml: figures", paper.metadata.figures),
        ("words.toml: captions", paper.texts.captions),
    )
    for place, figures in used:
        for name in figures:
            if name not in FIGURES:
                problem = f"{name!r}, which does not exist{suggest(name, FIGURES)}"
                raise PaperError(f"{paper.folder}/{place} {problem}")


def draw_figures(report: ReportData) -> Iterator[ReportFigure]:
    """Draw the figures that the paper of a report names, or without a paper `DEFAULT_FIGURES`."""
    names = report.paper.metadata.figures if report.paper else DEFAULT_FIGURES
    captions = report.paper.texts.captions if report.paper else {}
    has_world = bool(select_foragers(report.experiments))
    condition_links = link_conditions(report.lives)
    for name in names:
        kind = FIGURES[name]
        drawn = load_figure(name)(report)
        if drawn:
            addition = captions.get(name, "") if has_world or not kind.needs_world else ""
            # Figures of results without links get links to typical lifetimes.
            links = drawn.links if drawn.links or kind.is_setup else condition_links
            yield drawn._replace(
                name=name,
                caption=f"{drawn.caption} {addition}".rstrip(),
                links=links,
                is_setup=kind.is_setup,
            )
