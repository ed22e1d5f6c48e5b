"""Figure of the effect sizes of all papers: a row per system, a panel per effect."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from baldwinlab.analysis.assays.criteria import NO, NOT_MEASURED, UNDECIDED, YES
from baldwinlab.analysis.figures.style import BLUE, DARK_GRAY, GRAY, styled
from baldwinlab.analysis.gallery.analysis import EFFECTS, EffectResult, System
from baldwinlab.analysis.palette import VERMILION

# Width of the figure, in inches.
FIGURE_WIDTH: Final = 10.0
# Largest effect size inside the axes, as a share. Larger sizes are drawn at the edge.
MAX_SIZE: Final = 1.0
# Largest absolute value on the axes, in percent.
AXIS_LIMIT: Final = 108 * MAX_SIZE
# Heights of a row, and of the titles, the ticks and the legend together, in inches.
ROW_HEIGHT: Final = 0.2
AXES_HEIGHT: Final = 1.3
# Edge color, marker and face color of each verdict.
VERDICT_STYLES: Final = {
    YES: (BLUE, "o", BLUE),
    NO: (VERMILION, "X", VERMILION),
    UNDECIDED: (GRAY, "o", "white"),
}
VERDICT_LABELS: Final = {
    YES: "significant: yes",
    NO: "significant: no, or the opposite",
    UNDECIDED: "undecided",
}


@styled
def draw_effect_sizes(papers: Mapping[str, Sequence[System]]) -> Figure:
    """Draw effect sizes with their 95 % intervals, in percent of the fitness with learning.

    Parameters
    ----------
    papers : mapping of str to sequence of System
        Systems by paper.

    Returns
    -------
    Figure
        One row per system, one panel per effect.
    """
    systems = [system for paper in papers.values() for system in paper]
    rows = _system_rows(papers)
    n_rows = len(systems) + len(papers)
    figure = Figure((FIGURE_WIDTH, AXES_HEIGHT + ROW_HEIGHT * n_rows))
    panels = figure.subplots(1, len(EFFECTS), sharey=True)
    for axes, effect in zip(panels, EFFECTS, strict=True):
        axes.set_title(effect.title, loc="left", fontweight="bold")
        axes.axvline(0, color=DARK_GRAY, lw=0.8)
        for row, system in zip(rows, systems, strict=True):
            _draw_effect(axes, row, system.effects[effect.criterion])
        axes.set_xlim(-AXIS_LIMIT, AXIS_LIMIT)
        axes.set_xticks([-100, -50, 0, 50, 100], ["−100", "−50", "0", "50", "100 %"])
    panels[0].set_yticks(rows, [system.condition for system in systems])
    for paper, row in zip(papers, _heading_rows(papers), strict=True):
        _draw_heading(panels[0], paper, row)
    panels[0].set_ylim(max(rows) + 0.8, -0.8)
    figure.legend(
        handles=_make_legend_handles(), loc="outside lower center", ncols=len(VERDICT_STYLES)
    )
    return figure


def _system_rows(papers: Mapping[str, Sequence[System]]) -> list[int]:
    """Return the row of each system. The name of a paper is in a row above its systems."""
    rows: list[int] = []
    for systems, heading_row in zip(papers.values(), _heading_rows(papers), strict=True):
        first_row = heading_row + 1
        rows += range(first_row, first_row + len(systems))
    return rows


def _heading_rows(papers: Mapping[str, Sequence[System]]) -> list[int]:
    """Return the row of each paper's name."""
    # A paper has a row for its name, and a row for each system.
    n_rows = [1 + len(systems) for systems in papers.values()]
    first_rows = np.cumsum([0, *n_rows])[:-1]
    return [int(row) for row in first_rows]


def _draw_heading(axes: Axes, paper: str, row: int) -> None:
    axes.annotate(
        paper,
        (0, row),
        (-4, 0),
        xycoords=("axes fraction", "data"),
        textcoords="offset points",
        ha="right",
        va="center",
        fontweight="bold",
        annotation_clip=False,
    )


def _draw_effect(axes: Axes, row: int, result: EffectResult) -> None:
    if result.size is None or result.verdict == NOT_MEASURED:
        return
    edge, marker, face = VERDICT_STYLES[result.verdict]
    size = result.size
    median, low, high = (_to_percent(share) for share in (size.median, size.low, size.high))
    axes.plot([low, high], [row, row], color=edge, lw=1.4, solid_capstyle="butt")
    if abs(size.median) > MAX_SIZE:
        marker = ">" if median > 0 else "<"
    axes.plot([median], [row], marker=marker, ms=5, mec=edge, mfc=face, clip_on=False)


def _to_percent(share: float) -> float:
    """Return a share in percent, clipped to the range of the axes."""
    return float(np.clip(100 * share, -100 * MAX_SIZE, 100 * MAX_SIZE))


def _make_legend_handles() -> list[Line2D]:
    return [
        Line2D(
            [],
            [],
            color=edge,
            marker=marker,
            mec=edge,
            mfc=face,
            ms=5,
            label=VERDICT_LABELS[verdict],
        )
        for verdict, (edge, marker, face) in VERDICT_STYLES.items()
    ]
