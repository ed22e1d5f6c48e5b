"""Systems by answers: a row for each system, a panel for each question."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from baldwinlab.analysis.assays.analysis import NO, NOT_MEASURED, UNDECIDED, YES
from baldwinlab.analysis.figures.palette import VERMILION
from baldwinlab.analysis.figures.style import BLUE, DARK_GRAY, GRAY, styled
from baldwinlab.analysis.gallery.analysis import QUESTIONS, Answer, System

WIDTH: Final = 10.0  # inches
FARTHEST: Final = 1.0  # of the fitness as lived; what lies farther stands at the edge
LOOKS: Final = {
    YES: (BLUE, "o", BLUE),
    NO: (VERMILION, "X", VERMILION),
    UNDECIDED: (GRAY, "o", "white"),
}


@styled
def answers(papers: Mapping[str, Sequence[System]]) -> Figure:
    """Sizes with their 95 % intervals, in percent of the fitness as lived, by paper and system."""
    rows = [(paper, system) for paper, found in papers.items() for system in found]
    figure = Figure((WIDTH, 1.3 + 0.2 * (len(rows) + len(papers))))
    panels = figure.subplots(1, len(QUESTIONS), sharey=True)
    places = _places(papers)
    for axes, question in zip(panels, QUESTIONS, strict=True):
        axes.set_title(question.title, loc="left", fontweight="bold")
        axes.axvline(0, color=DARK_GRAY, lw=0.8)
        for place, (_, system) in zip(places, rows, strict=True):
            _mark(axes, place, system.answers[question.criterion])
        axes.set_xlim(-108 * FARTHEST, 108 * FARTHEST)
        axes.set_xticks([-100, -50, 0, 50, 100], ["−100", "−50", "0", "50", "100 %"])
    panels[0].set_yticks(places, [system.condition for _, system in rows])
    for (paper, _), place in zip(papers.items(), _headings(papers), strict=True):
        panels[0].annotate(
            paper, (0, place), (-4, 0), xycoords=("axes fraction", "data"), textcoords="offset points", ha="right", va="center",
            fontweight="bold", annotation_clip=False,
        )  # fmt: skip
    panels[0].set_ylim(max(places) + 0.8, -0.8)
    figure.legend(handles=_keys(), loc="outside lower center", ncols=len(LOOKS))
    return figure


def _places(papers: Mapping[str, Sequence[System]]) -> list[int]:
    """Where rows stand: below a line with their paper's name."""
    places: list[int] = []
    line = 0
    for found in papers.values():
        places += range(line + 1, line + 1 + len(found))
        line += 1 + len(found)
    return places


def _headings(papers: Mapping[str, Sequence[System]]) -> list[int]:
    return [
        int(place) for place in np.cumsum([0, *(1 + len(found) for found in papers.values())])[:-1]
    ]


def _mark(axes: Axes, place: int, answer: Answer) -> None:
    if answer.size is None or answer.verdict == NOT_MEASURED:
        return
    edge, marker, face = LOOKS[answer.verdict]
    value, low, high = (
        float(np.clip(100 * each, -100 * FARTHEST, 100 * FARTHEST)) for each in answer.size[1:]
    )
    axes.plot([low, high], [place, place], color=edge, lw=1.4, solid_capstyle="butt")
    beyond = abs(answer.size.median) > FARTHEST
    axes.plot(
        [value],
        [place],
        marker=(">" if value > 0 else "<") if beyond else marker,
        ms=5,
        mec=edge,
        mfc=face,
        clip_on=False,
    )


def _keys() -> list[Line2D]:
    words = {
        YES: "established: yes",
        NO: "established: no, or the opposite",
        UNDECIDED: "undecided",
    }
    return [
        Line2D([], [], color=edge, marker=marker, mec=edge, mfc=face, ms=5, label=words[verdict])
        for verdict, (edge, marker, face) in LOOKS.items()
    ]
