"""Draw fitness by generation and at the end: a row per map, a column for best and mean fitness."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import pairwise
from math import ceil
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from baldwinlab.analysis.claim_results import ClaimResult, Finding
from baldwinlab.analysis.figures.style import (
    BLACK,
    FIGURE_WIDTH,
    GRAY,
    SeriesStyle,
    choose_style,
    spread_points,
    styled,
)
from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.statistics.curve_intervals import interval_of_mean
from baldwinlab.analysis.statistics.rules import SIGNIFICANCE_LEVEL
from baldwinlab.experiment.factors import read_factors

# Largest number of brackets above each other. More would hide the boxes.
MAX_BRACKETS = 6
# Number of letters of horizontal labels that fit below a panel.
MAX_LABEL_LETTERS = 48
# Heights of the smallest legend, of a row of the legend, and of a panel, in inches.
LEGEND_HEIGHT = 0.5
LEGEND_ROW_HEIGHT = 0.2
PANEL_HEIGHT = 2.5
# Largest number of columns of the legend, and the width of its line and gaps, in letters.
MAX_LEGEND_COLUMNS = 4
LEGEND_LINE_LETTERS = 8
# Largest number of boxes in a panel of half the width of the figure. With more, the panels of both
# measures are below each other, so that the labels do not overlap.
MAX_BOXES_OF_HALF_WIDTH = 24
# Height of the titles and the margins in the figure of boxes, in inches.
BOX_MARGIN_HEIGHT = 0.9
# Length of a vertical label, in inches per letter.
LETTER_INCHES = 0.075
# Widths of a box, and of its points, if the distance of two boxes is 1.
BOX_WIDTH = 0.55
POINT_SPREAD = 0.36
# Vertical distance of two brackets, as a share of the height of the panel.
BRACKET_DISTANCE = 0.13
# Largest number of markers on a curve.
MAX_MARKERS = 8
# Titles of the columns by measure.
MEASURE_TITLES = {"best": "best agent", "mean": "average agent"}


class PlottedCondition(NamedTuple):
    """A condition, its factors and its appearance."""

    name: str
    learner: str
    map_name: str
    style: SeriesStyle


def plotted_conditions(dataset: xr.Dataset) -> list[PlottedCondition]:
    """Return the conditions in the order of the study. A learner has one style on all maps."""
    factors = read_factors(dataset)
    learners = list(dict.fromkeys(levels.learner for levels in factors.values()))
    return [
        PlottedCondition(
            name=name,
            learner=levels.learner,
            map_name=levels.map,
            style=choose_style(learners.index(levels.learner)),
        )
        for name, levels in factors.items()
    ]


class _Panel(NamedTuple):
    axes: Axes
    measure: str
    conditions: list[PlottedCondition]


def _make_panels(
    figure: Figure, dataset: xr.Dataset, is_single_column: bool = False
) -> Iterator[_Panel]:
    """Yield a panel for each map and measure, with the conditions to draw in it."""
    conditions = plotted_conditions(dataset)
    maps = list(dict.fromkeys(condition.map_name for condition in conditions))
    columns = 1 if is_single_column else len(MEASURE_TITLES)
    grid = figure.subplots(len(maps) * len(MEASURE_TITLES) // columns, columns, squeeze=False)
    for row, map_name in zip(grid.reshape(len(maps), -1), maps, strict=True):
        conditions_on_map = [
            condition for condition in conditions if condition.map_name == map_name
        ]
        for axes, (measure, measure_title) in zip(row, MEASURE_TITLES.items(), strict=True):
            title = f"Map {map_name}, {measure_title}" if map_name else measure_title.capitalize()
            axes.set_title(title, loc="left", fontweight="bold")
            is_energy = dataset["energy"].attrs.get("units") == "energy"
            axes.set_ylabel("fitness (energy)" if is_energy else "fitness")
            yield _Panel(axes, measure, conditions_on_map)
            # The caller has drawn the panel now, so its limit is known.
            top = _panel_top(axes)
            axes.set_ylim(-0.025 * top, top)


def _panel_top(axes: Axes) -> float:
    """Return the upper limit of a panel, or 1 if no fitness is above 0."""
    return axes.get_ylim()[1] if axes.dataLim.y1 > 0 else 1.0


def _count_legend_columns(labels: Sequence[str]) -> int:
    """Return the number of columns whose labels fit next to each other."""
    letters = max(map(len, labels), default=0) + LEGEND_LINE_LETTERS
    n_columns = int(FIGURE_WIDTH / (LETTER_INCHES * letters))
    return min(max(1, n_columns), MAX_LEGEND_COLUMNS, len(labels))


@styled
def draw_fitness_curves(dataset: xr.Dataset) -> Figure:
    """Draw fitness by generation: the mean over runs and its 95 % interval (Student's t).

    Parameters
    ----------
    dataset
        Runs as (condition, run, generation, agent).

    Returns
    -------
    Figure
        A row per map, a column for best and mean fitness. A single run has no interval.
    """
    conditions = plotted_conditions(dataset)
    learners = {condition.learner: condition.style for condition in reversed(conditions)}
    n_columns = _count_legend_columns(list(learners))
    legend_height = max(LEGEND_HEIGHT, LEGEND_ROW_HEIGHT * ceil(len(learners) / n_columns))
    n_maps = len({condition.map_name for condition in conditions})
    figure = Figure((FIGURE_WIDTH, legend_height + PANEL_HEIGHT * n_maps))
    tables = {measure: fitness.MEASURES[measure](dataset) for measure in MEASURE_TITLES}
    for axes, measure, conditions_on_map in _make_panels(figure, dataset):
        for condition in conditions_on_map:
            _draw_curve(axes, tables[measure].sel(condition=condition.name), condition.style)
        axes.set_xlabel("generation")
        axes.xaxis.set_major_locator(MaxNLocator(integer=True, steps=[1, 2, 5, 10], min_n_ticks=1))
    handles = [
        figure.axes[0].plot(
            [], [], color=style.color, ls=style.line, marker=style.marker, ms=4, label=learner
        )[0]
        for learner, style in reversed(learners.items())
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=n_columns)
    return figure


def _draw_curve(axes: Axes, values: xr.DataArray, style: SeriesStyle) -> None:
    average, low, high = interval_of_mean(values)
    generation = values["generation"].values
    axes.fill_between(generation, low, high, color=style.color, alpha=0.18, lw=0)
    axes.plot(
        generation,
        average,
        color=style.color,
        ls=style.line,
        lw=1.5,
        marker=style.marker,
        ms=3.5,
        markevery=max(1, len(generation) // MAX_MARKERS),
    )


@styled
def draw_fitness_boxes(
    dataset: xr.Dataset, results: Sequence[ClaimResult], last: int = 10
) -> Figure:
    """Draw final fitness: a box per condition and a point per run.

    Parameters
    ----------
    dataset
        Runs as (condition, run, generation, agent).
    results
        Evaluated claims. Brackets join the conditions that they compare, with the p-value corrected
        for all claims.
    last
        Number of final generations over which a run is averaged.

    Returns
    -------
    Figure
        A row per map, a column for best and mean fitness; with many conditions, a row for each.
        Boxes show quartiles; whiskers reach to the farthest run within 1.5 times the interquartile
        range.
    """
    labels = _labels_by_map(dataset)
    n_boxes = Counter(condition.map_name for condition in plotted_conditions(dataset))
    is_single_column = max(n_boxes.values()) > MAX_BOXES_OF_HALF_WIDTH
    n_rows = len(labels) * (len(MEASURE_TITLES) if is_single_column else 1)
    label_heights = {
        map_name: 0 if _fit_horizontally(names) else LETTER_INCHES * max(map(len, names))
        for map_name, names in labels.items()
    }
    label_height = sum(label_heights.values()) * (n_rows // len(labels))
    figure = Figure((FIGURE_WIDTH, BOX_MARGIN_HEIGHT + PANEL_HEIGHT * n_rows + label_height))
    tables = {measure: fitness.final(dataset, measure, last) for measure in MEASURE_TITLES}
    for axes, measure, conditions_on_map in _make_panels(figure, dataset, is_single_column):
        for position, condition in enumerate(conditions_on_map):
            sample = tables[measure].sel(condition=condition.name).dropna("run").values
            if sample.size:
                draw_box(axes, position, sample, condition.style)
        map_name = conditions_on_map[0].map_name
        tick_labels = labels[map_name] or [""] * len(conditions_on_map)
        rotation = 90 if label_heights[map_name] else 0
        axes.set_xticks(range(len(conditions_on_map)), tick_labels, rotation=rotation)
        axes.set_xlim(-0.6, len(conditions_on_map) - 0.4)
        axes.grid(visible=False, axis="x")
        names = [condition.name for condition in conditions_on_map]
        _draw_brackets(axes, names, _select_findings(results, measure))
    return figure


def _labels_by_map(dataset: xr.Dataset) -> dict[str, list[str]]:
    """Return the labels below the panels of each map.

    If all maps have the same learners and the labels are vertical, only the last map has labels.
    """
    labels: dict[str, list[str]] = {}
    for condition in plotted_conditions(dataset):
        labels.setdefault(condition.map_name, []).append(condition.learner)
    *upper_maps, last_map = labels
    is_shared = all(labels[map_name] == labels[last_map] for map_name in upper_maps)
    if is_shared and not _fit_horizontally(labels[last_map]):
        return labels | {map_name: [] for map_name in upper_maps}
    return labels


def _fit_horizontally(labels: Sequence[str]) -> bool:
    """Return whether labels fit next to each other below a panel."""
    pair_lengths = [len(left) + len(right) for left, right in pairwise(labels)]
    # Neighbors share the space of two boxes.
    letters_per_box = max(pair_lengths, default=0) / 2
    return letters_per_box * len(labels) <= MAX_LABEL_LETTERS


def draw_box(axes: Axes, position: int, sample: np.ndarray, style: SeriesStyle) -> None:
    """Draw a box plot, and a point per run."""
    line = {"color": style.color, "linewidth": 1.1}
    axes.boxplot(
        [sample],
        positions=[position],
        widths=BOX_WIDTH,
        showfliers=False,
        manage_ticks=False,
        boxprops=line,
        whiskerprops=line,
        capprops=line,
        medianprops=line | {"linewidth": 2.2},
    )
    offsets = POINT_SPREAD * spread_points(sample.size)
    axes.plot(
        position + offsets,
        sample,
        style.marker,
        color=style.color,
        ms=3.2,
        alpha=0.6,
        mew=0,
        clip_on=False,
    )


def _select_findings(results: Sequence[ClaimResult], measure: str) -> list[Finding]:
    findings = (finding for result in results for finding in result.findings)
    return [finding for finding in findings if finding.comparison.measure == measure]


class _Bracket(NamedTuple):
    """The p-value of two conditions, by their positions in a panel."""

    left: int
    right: int
    p: float

    @property
    def color(self) -> str:
        """Black if the difference is significant, else gray."""
        return BLACK if self.p < SIGNIFICANCE_LEVEL else GRAY


def _make_brackets(names: list[str], findings: list[Finding]) -> list[_Bracket]:
    brackets = []
    for finding in findings:
        compared = (finding.comparison.a, finding.comparison.b)
        positions = [names.index(name) for name in compared if name in names]
        # A bracket joins two conditions of the panel.
        if len(positions) == len(compared):
            brackets.append(_Bracket(min(positions), max(positions), finding.p_holm))
    return brackets


def _draw_brackets(axes: Axes, names: list[str], findings: list[Finding]) -> None:
    """Draw brackets above the boxes, short ones below long ones."""
    brackets = _make_brackets(names, findings)
    top = _panel_top(axes)
    if len(brackets) > MAX_BRACKETS:
        _draw_against_baseline(axes, brackets, top)
        return
    ordered = sorted(brackets, key=lambda bracket: (bracket.right - bracket.left, bracket.left))
    for level, bracket in enumerate(ordered):
        height = top * (1.06 + BRACKET_DISTANCE * level)
        foot = height - 0.02 * top
        left = bracket.left + 0.04
        right = bracket.right - 0.04
        x = [left, left, right, right]
        axes.plot(x, [foot, height, height, foot], color=BLACK, lw=0.8)
        axes.text(
            (bracket.left + bracket.right) / 2,
            height + 0.01 * top,
            format_p_label(bracket.p),
            ha="center",
            va="bottom",
            color=bracket.color,
        )
    if brackets:
        axes.set_ylim(top=top * (1.1 + BRACKET_DISTANCE * len(brackets)))


def _draw_against_baseline(axes: Axes, brackets: list[_Bracket], top: float) -> None:
    """Write each p-value above its box, if all comparisons share a condition."""
    pairs = ({bracket.left, bracket.right} for bracket in brackets)
    vertical: dict[str, Any] = {"rotation": 90, "ha": "center", "va": "bottom"}
    # Empty if no condition is part of all comparisons.
    for baseline in set.intersection(*pairs):
        axes.text(baseline, 1.03 * top, "against", **vertical)
        for bracket in brackets:
            # The end of the bracket that is not the baseline.
            position = bracket.left + bracket.right - baseline
            label = format_p_label(bracket.p)
            axes.text(position, 1.03 * top, label, **vertical, color=bracket.color)
        axes.set_ylim(top=1.7 * top)


def format_p_label(p: float) -> str:
    """Return a p-value as text, such as "p = 0.013"."""
    if p < 0.001:
        return "p < 0.001"
    return f"p = {p:.2g}" if p < 0.995 else "p = 1"
