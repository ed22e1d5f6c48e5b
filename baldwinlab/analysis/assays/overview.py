"""Overview of many conditions, which replaces a figure and several sentences for each of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from baldwinlab.analysis.assays.analysis import Analysis, ConditionResult
from baldwinlab.analysis.assays.criteria import NO, NOT_MEASURED, YES
from baldwinlab.analysis.assays.headlines import describe_phases
from baldwinlab.analysis.assays.phrases import fill_terms
from baldwinlab.analysis.figures.overview import OverviewCell
from baldwinlab.analysis.figures.overview import draw_overview as draw_cell_tables
from baldwinlab.analysis.report.embedding import ReportFigure

# Largest number of conditions that the section shows in full. More are shown in an overview.
MAX_CONDITIONS_IN_FULL: Final = 8
# Titles of the shown criteria of questions.toml.
CRITERION_TITLES: Final = {
    "gain": "Gain from learning",
    "innate": "Rise of innate fitness",
    "cost": "Cost of learning",
    "built-innate": "Effect of selection on innate fitness",
    "built-learned": "Effect of selection on the gain from learning",
}
CRITERION_CAPTIONS: Final = {
    "gain": "fitness of the average agent with learning, minus its fitness without learning, over "
    "all generations",
    "innate": "innate fitness in the last generations, minus the same in the first generations",
    "cost": "fitness of agents born with their {weights} at death, minus fitness of agents that "
    "learn from birth (below 0, the {weights} at death do not suffice)",
    "built-innate": "innate fitness in the last generations, minus the same in the neutral "
    "control, whose parents are chosen at random",
    "built-learned": "gain from learning in the last generations, minus the same in the neutral "
    "control",
}
CELLS_NOTE: Final = (
    "Numbers are medians over runs. Darker cells are closer to the largest value of their map. A "
    "triangle marks a significant difference: above 0 (up) or below 0 (down)."
)


def is_large(analysis: Analysis) -> bool:
    """Return whether the section is an overview, because it has many conditions."""
    return len(analysis.results) > MAX_CONDITIONS_IN_FULL


def group_by_verdict(analysis: Analysis) -> dict[str, list[str]]:
    """Group conditions by their verdict, the largest group first.

    Parameters
    ----------
    analysis : Analysis
        The analysis.

    Returns
    -------
    dict of str to list of str
        Conditions by verdict. Conditions without a verdict are left out.
    """
    groups: dict[str, list[str]] = {}
    for result in analysis.results:
        if {result.phase_verdict(1), result.phase_verdict(2)} != {NOT_MEASURED}:
            groups.setdefault(describe_phases(result), []).append(result.condition)
    return dict(sorted(groups.items(), key=_count_conditions, reverse=True))


def _count_conditions(group: tuple[str, list[str]]) -> int:
    _, conditions = group
    return len(conditions)


def draw_overview(analysis: Analysis, order: Sequence[str]) -> ReportFigure | None:
    """Draw the differences of all conditions as a table of cells.

    Parameters
    ----------
    analysis : Analysis
        The analysis.
    order : sequence of str
        The conditions, in the order of the figure.

    Returns
    -------
    ReportFigure or None
        The figure, or None if no shown criterion was measured.
    """
    results = sorted(analysis.results, key=lambda result: order.index(result.condition))
    panels = {criterion: _make_cells(results, criterion) for criterion in CRITERION_TITLES}
    panels = {criterion: cells for criterion, cells in panels.items() if cells}
    if not panels:
        return None
    titled = {CRITERION_TITLES[criterion]: cells for criterion, cells in panels.items()}
    captions = "; ".join(
        fill_terms(CRITERION_CAPTIONS[criterion], analysis.terms) for criterion in panels
    )
    title = "Gain from learning and innate fitness"
    return ReportFigure(
        name="baldwin-overview",
        title=title,
        caption=f"From top to bottom: {captions}. {CELLS_NOTE}",
        alternative=f"{title}. Medians over runs. {_list_medians(titled)}.",
        figure=draw_cell_tables(titled),
        table=[
            {"quantity": panel, **cell._asdict()}
            for panel, cells in titled.items()
            for cell in cells
        ],
    )


def _list_medians(panels: Mapping[str, Sequence[OverviewCell]]) -> str:
    texts = []
    for title, cells in panels.items():
        medians = ", ".join(f"{cell.condition} {round(cell.median)}" for cell in cells)
        texts.append(f"{title}: {medians}")
    return "; ".join(texts)


def _make_cells(results: Sequence[ConditionResult], criterion: str) -> list[OverviewCell]:
    cells = []
    for result in results:
        answer = result.answer(criterion)
        if answer.numbers:
            cells.append(_make_cell(result, answer.numbers.effect, answer.verdict))
    return cells


def _make_cell(result: ConditionResult, effect: float, verdict: str) -> OverviewCell:
    is_significant = verdict in (YES, NO)
    direction = int(np.sign(effect)) if is_significant else 0
    return OverviewCell(
        condition=result.condition,
        learner=result.factors.learner,
        map=result.factors.map,
        median=effect,
        verdict=verdict,
        direction=direction,
    )
