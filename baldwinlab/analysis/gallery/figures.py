"""Effect sizes of all papers: a row for each system, a panel for each effect."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from baldwinlab.analysis.assays.criteria import NO, NOT_MEASURED, UNDECIDED, YES
from baldwinlab.analysis.figures.style import BLUE, DARK_GRAY, GRAY, styled
from baldwinlab.analysis.gallery.analysis import EFFECTS, System, SystemAnswer
from baldwinlab.analysis.palette import VERMILION

# Inches.
WIDTH: Final = 10.0
# Largest shown size. Larger ones are drawn at the edge.
LIMIT: Final = 1.0
# Edge color, marker and face color of each verdict.
STYLES: Final = {
    YES: (BLUE, "o", BLUE),
    NO: (VERMILION, "X", VERMILION),
    UNDECIDED: (GRAY, "o", "white"),
}
LABELS: Final = {
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
    figure = Figure((WIDTH, 1.3 + 0.2 * (len(systems) + len(papers))))
    panels = figure.subplots(1, len(EFFECTS), sharey=True)
    for axes, effect in zip(panels, EFFECTS, strict=True):
        axes.set_title(effect.title, loc="left", fontweight="bold")
        axes.axvline(0, color=DARK_GRAY, lw=0.8)
        for row, system in zip(rows, systems, strict=True):
            _draw_answer(axes, row, system.answers[effect.criterion])
        axes.set_xlim(-108 * LIMIT, 108 * LIMIT)
        axes.set_xticks([-100, -50, 0, 50, 100], ["−100", "−50", "0", "50", "100 %"])
    panels[0].set_yticks(rows, [system.condition for system in systems])
    for paper, row in zip(papers, _heading_rows(papers), strict=True):
        _draw_heading(panels[0], paper, row)
    panels[0].set_ylim(max(rows) + 0.8, -0.8)
    figure.legend(handles=_make_keys(), loc="outside lower center", ncols=len(STYLES))
    return figure


def _system_rows(papers: Mapping[str, Sequence[System]]) -> list[int]:
    """Return the row of each system. The name of a paper is in a row above its systems."""
    rows: list[int] = []
    for systems, heading in zip(papers.values(), _heading_rows(papers), strict=True):
        rows += range(heading + 1, heading + 1 + len(systems))
    return rows


def _heading_rows(papers: Mapping[str, Sequence[System]]) -> list[int]:
    heights = [1 + len(systems) for systems in papers.values()]
    return [int(row) for row in np.cumsum([0, *heights])[:-1]]


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


def _draw_answer(axes: Axes, row: int, answer: SystemAnswer) -> None:
    if answer.size is None or answer.verdict == NOT_MEASURED:
        return
    edge, marker, face = STYLES[answer.verdict]
    value, low, high = (_to_percent(number) for number in answer.size[1:])
    axes.plot([low, high], [row, row], color=edge, lw=1.4, solid_capstyle="butt")
    if abs(answer.size.median) > LIMIT:
        marker = ">" if value > 0 else "<"
    axes.plot([value], [row], marker=marker, ms=5, mec=edge, mfc=face, clip_on=False)


def _to_percent(share: float) -> float:
    return float(np.clip(100 * share, -100 * LIMIT, 100 * LIMIT))


def _make_keys() -> list[Line2D]:
    return [
        Line2D([], [], color=edge, marker=marker, mec=edge, mfc=face, ms=5, label=LABELS[verdict])
        for verdict, (edge, marker, face) in STYLES.items()
    ]
