"""Report section on opponents of earlier generations: sentences, a figure and a table."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import chain
from pathlib import Path
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from baldwinlab.analysis.assays.opponents import (
    GenerationTest,
    SpeciesMatrix,
    compare_generations,
    compose_sentences,
    group_by_question,
    list_matrices,
)
from baldwinlab.analysis.figures.style import FIGURE_WIDTH, styled
from baldwinlab.analysis.report.embedding import ReportFigure, save_and_inline
from baldwinlab.analysis.report.sections import Section, render
from baldwinlab.analysis.statistics.curve_intervals import interval_of_median
from baldwinlab.analysis.statistics.numbers import format_number
from baldwinlab.analysis.statistics.sample_sizes import PlannedTest, describe_too_few
from baldwinlab.core.assay_variables import OPPONENTS

TITLE: Final = "Opponents of earlier generations"
CAPTION: Final = (
    "Fitness of the average agent of a species, by its generation (row) and by the generation of "
    "its opponents (column). Numbers are medians over runs. Darker cells are closer to the "
    "largest value of the species in all conditions."
)
# Text on cells with at least this share of the largest value is white.
MIN_SHARE_FOR_WHITE_TEXT: Final = 0.85
PANEL_HEIGHT: Final = 2.1
"""Height of the panels of a condition, in inches."""


def make_section(stored: Mapping[str, xr.Dataset], folder: Path) -> Section:
    """Make the section of a report on the assay `opponents`, and save its figure."""
    tests = compare_generations(stored)
    sentences = compose_sentences(tests)
    too_few = describe_too_few([_planned_test(test) for test in tests])
    figure = ReportFigure(
        name=OPPONENTS,
        title=TITLE,
        caption=CAPTION,
        alternative=f"{TITLE}. {' '.join(sentences)}",
        figure=draw_matrices(stored),
        table=_tabulate_matrices(stored),
        commands=(f"baldwinlab assay . --assays {OPPONENTS}",),
    )
    body = render(
        "assays/opponents.html",
        sentences=sentences,
        too_few=too_few,
        figure=save_and_inline(figure, folder),
        groups=group_by_question(tests),
    )
    return Section(anchor=OPPONENTS, title=TITLE, body=body, summary=" ".join(sentences))


def _planned_test(test: GenerationTest) -> PlannedTest:
    return PlannedTest(n_a=test.pairs.n, n_b=test.pairs.n, method="Wilcoxon")


@styled
def draw_matrices(stored: Mapping[str, xr.Dataset]) -> Figure:
    """Draw the fitness of both species by generation and by generation of the opponents.

    The figure has one row per condition, one column per species.
    """
    matrices = {condition: list_matrices(data) for condition, data in stored.items()}
    figure = Figure((FIGURE_WIDTH, PANEL_HEIGHT * len(stored)))
    grid = figure.subplots(len(stored), 2, squeeze=False)
    # The largest median of each species in all conditions.
    largest: dict[str, float] = {}
    for matrix in chain.from_iterable(matrices.values()):
        value = float(matrix.fitness.median("run").max())
        largest[matrix.species] = max(value, largest.get(matrix.species, value))
    for row, (condition, pair) in zip(grid, matrices.items(), strict=True):
        for axes, matrix in zip(row, pair, strict=True):
            _draw_matrix(axes, matrix, largest[matrix.species])
            axes.set_title(f"{condition}: {matrix.species}", loc="left", fontweight="bold")
    return figure


def _draw_matrix(axes: Axes, matrix: SpeciesMatrix, largest: float) -> None:
    medians = matrix.fitness.median("run").values
    scale = largest if largest > 0 else 1.0
    axes.imshow(medians / scale, cmap="Blues", vmin=0, vmax=1.2, aspect="auto")
    for (row, column), median in np.ndenumerate(medians):
        color = "white" if median / scale >= MIN_SHARE_FOR_WHITE_TEXT else "black"
        axes.text(column, row, format_number(median), ha="center", va="center", color=color)
    generations = matrix.fitness["own"].values.tolist()
    axes.set_xticks(range(len(generations)), generations)
    axes.set_yticks(range(len(generations)), generations)
    axes.set(xlabel=f"generation of {matrix.opponents}", ylabel=f"generation of {matrix.species}")
    axes.tick_params(length=0)
    axes.grid(visible=False)
    axes.spines[:].set_visible(False)


def _tabulate_matrices(stored: Mapping[str, xr.Dataset]) -> list[dict[str, Any]]:
    """Return the data of the figure: medians over runs with their intervals."""
    rows = []
    for condition, data in stored.items():
        interval = interval_of_median(data["energy"])
        numbers = {"median": interval.center, "low": interval.low, "high": interval.high}
        table = xr.Dataset(numbers).to_dataframe().reset_index().to_dict("records")
        rows += [{"condition": condition, **row} for row in table]
    return rows
