"""Draw final fitness as a table: a row for each learner, a column for each map."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from baldwinlab.analysis.claim_results import ClaimResult
from baldwinlab.analysis.figures.fitness import plotted_conditions
from baldwinlab.analysis.figures.style import BLUE, styled
from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.statistics.rules import FAILS, HOLDS, NOT_EVALUATED, UNDECIDED, Verdict

VERDICT_DIRECTIONS: Mapping[Verdict, int] = {HOLDS: 1, FAILS: -1, UNDECIDED: 0, NOT_EVALUATED: 0}
DIRECTION_MARKS = {1: " ▲", -1: " ▼", 0: ""}
# Share of the best value on a map, above which text is white.
MIN_SHARE_FOR_WHITE_TEXT = 0.6
# Width of a column and of a letter, in inches. Narrow columns let a phone show all maps.
COLUMN_WIDTH = 0.75
LETTER_WIDTH = 0.08
# Heights of a row and of a heading, and width of the margins, in inches.
ROW_HEIGHT = 0.3
HEADING_HEIGHT = 0.7
MARGIN = 0.3


class OverviewCell(NamedTuple):
    """The result of a condition. The fields are the columns of the figure's table.

    Attributes
    ----------
    condition, learner, map : str
        The condition and its factors.
    median : float
        Median over runs of the plotted value.
    verdict : str
        Verdict of the claim about the condition, or an empty string.
    direction : int
        1 if the value is significantly greater, -1 if it is lower, else 0.
    """

    condition: str
    learner: str
    map: str
    median: float
    verdict: str
    direction: int


def overview_cells(
    dataset: xr.Dataset, results: Sequence[ClaimResult], last: int
) -> list[OverviewCell]:
    """Return the final mean fitness of each condition that has runs.

    Parameters
    ----------
    dataset
        Runs as (condition, run, generation, agent).
    results
        Evaluated claims. A cell has the verdict of the claim that the condition has greater mean
        fitness than another condition on the same map.
    last
        Number of final generations over which a run is averaged.

    Returns
    -------
    list of OverviewCell
        The cells, in the order of the study.
    """
    medians = fitness.final(dataset, "mean", last).median("run")
    conditions = plotted_conditions(dataset)
    verdicts = _find_verdicts(
        results, {condition.name: condition.map_name for condition in conditions}
    )
    cells = []
    for condition in conditions:
        verdict = verdicts.get(condition.name)
        direction = VERDICT_DIRECTIONS[verdict] if verdict else 0
        cell = OverviewCell(
            condition=condition.name,
            learner=condition.learner,
            map=condition.map_name,
            median=float(medians.sel(condition=condition.name)),
            verdict=verdict or "",
            direction=direction,
        )
        if np.isfinite(cell.median):
            cells.append(cell)
    return cells


def _find_verdicts(results: Sequence[ClaimResult], maps: Mapping[str, str]) -> dict[str, Verdict]:
    """Return the verdicts of claims that a condition has greater mean fitness on its map.

    `maps` has the map of each condition.
    """
    verdicts: dict[str, Verdict] = {}
    findings = [finding for result in results for finding in result.findings]
    for finding in findings:
        comparison = finding.comparison
        is_same_map = maps.get(comparison.a) == maps.get(comparison.b or "")
        compares_means = comparison.rule == "greater" and comparison.measure == "mean"
        if compares_means and is_same_map:
            verdicts[comparison.a] = finding.verdict
    return verdicts


@styled
def draw_overview(panels: Mapping[str, Sequence[OverviewCell]]) -> Figure:
    """Draw tables of medians, one below another.

    Parameters
    ----------
    panels
        The cells of each table, by its title.

    Returns
    -------
    Figure
        Each cell has the median and a triangle if the difference is significant. A darker cell is
        nearer to the best value on its map.
    """
    n_rows = [len({cell.learner for cell in cells}) for cells in panels.values()]
    n_columns = max(len({cell.map for cell in cells}) for cells in panels.values())
    all_cells = [cell for cells in panels.values() for cell in cells]
    labels_width = LETTER_WIDTH * max((len(cell.learner) for cell in all_cells), default=0)
    title_widths = [LETTER_WIDTH * len(title) for title in panels]
    table_width = max(COLUMN_WIDTH * n_columns, *title_widths)
    height = HEADING_HEIGHT * len(panels) + ROW_HEIGHT * sum(n_rows)
    figure = Figure((MARGIN + labels_width + table_width, height))
    grid = figure.subplots(len(panels), squeeze=False, height_ratios=n_rows)
    for axes, (title, cells) in zip(grid.flat, panels.items(), strict=True):
        _draw_table(axes, cells)
        if title:
            axes.set_title(title, loc="left", fontweight="bold")
    return figure


def _draw_table(axes: Axes, cells: Sequence[OverviewCell]) -> None:
    learners = list(dict.fromkeys(cell.learner for cell in cells))
    maps = list(dict.fromkeys(cell.map for cell in cells))
    best_medians = {name: max(cell.median for cell in cells if cell.map == name) for name in maps}
    shares = np.full((len(learners), len(maps)), np.nan)
    for cell in cells:
        row = learners.index(cell.learner)
        column = maps.index(cell.map)
        best_median = best_medians[cell.map]
        shares[row, column] = max(cell.median, 0) / best_median if best_median > 0 else 0
        text = f"{round(cell.median)}{DIRECTION_MARKS[cell.direction]}"
        color = "white" if shares[row, column] > MIN_SHARE_FOR_WHITE_TEXT else "black"
        axes.text(column, row, text, ha="center", va="center", color=color)
    white_to_blue = LinearSegmentedColormap.from_list("to blue", ["white", BLUE])
    axes.imshow(shares, aspect="auto", vmin=0, vmax=1, cmap=white_to_blue)
    axes.set_xticks(range(len(maps)), [f"Map {name}" if name else "" for name in maps])
    axes.set_yticks(range(len(learners)), learners)
    axes.xaxis.tick_top()
    axes.tick_params(length=0)
    axes.grid(visible=False)
    axes.spines[:].set_visible(False)
