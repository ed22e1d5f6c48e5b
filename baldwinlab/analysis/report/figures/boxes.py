"""Boxes of final fitness, with p-values of claims, and of the measures that models declare.

A condition has a box, and a run has a point.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from baldwinlab.analysis.claim_results import ClaimResult, Finding
from baldwinlab.analysis.claim_samples import ModelMeasure
from baldwinlab.analysis.figures.charts import BOXES_NOTE, draw_box
from baldwinlab.analysis.figures.curves import LETTER_INCHES, draw_legend, find_top
from baldwinlab.analysis.figures.style import (
    BLACK,
    FIGURE_WIDTH,
    GRAY,
    group_by_map,
    style_conditions,
    styled,
)
from baldwinlab.analysis.report.content import describe_final_medians, name_fitness, tabulate_runs
from baldwinlab.analysis.report.data import ReportData
from baldwinlab.analysis.report.figures.fitness import (
    MEASURE_TITLES,
    PANEL_HEIGHT,
    make_panels,
)
from baldwinlab.analysis.report.sections import ReportFigure
from baldwinlab.analysis.results.numbers import format_number
from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.statistics.significance import SIGNIFICANCE_LEVEL

# Largest number of brackets above each other. More would hide the boxes.
MAX_BRACKETS = 6
# Number of letters of horizontal labels that fit below a panel.
MAX_LABEL_LETTERS = 48
# Largest number of boxes in a panel of half the width of the figure. With more, the panels of both
# measures are below each other, so that the labels do not overlap.
MAX_BOXES_OF_HALF_WIDTH = 24
# Height of the titles and the margins in the figure of boxes, in inches.
BOX_MARGIN_HEIGHT = 0.9
# Vertical distance of two brackets, as a fraction of the height of the panel.
BRACKET_DISTANCE = 0.13


def draw_figure(report: ReportData) -> ReportFigure:
    p_values = describe_p_values(report.data, report.results)
    return ReportFigure(
        title=f"Fitness in the last {report.last} generations",
        caption=(
            f"{name_fitness(report.data, 'best', 'average')}, averaged over the last "
            f"{report.last} generations of each run. "
            f"{' '.join(filter(None, [BOXES_NOTE, p_values]))}"
        ),
        alternative=(
            "Box plots of final fitness by condition. "
            f"{describe_final_medians(report.data, report.last)}"
        ),
        figure=draw_fitness_boxes(report.data, report.results, report.last),
        table=tabulate_runs(report.data, report.last),
    )


@styled
def draw_fitness_boxes(
    dataset: xr.Dataset, results: Sequence[ClaimResult], last: int = 10
) -> Figure:
    """Draw final fitness: a box per condition and a point per run.

    `dataset`: runs as (condition, run, generation, agent). Each map has a row with two panels, best
    and mean fitness. With many conditions, each panel has its own row. Boxes show quartiles.
    Whiskers reach to the farthest run within 1.5 times the interquartile range.
    """
    labels = _labels_by_map(dataset)
    n_boxes = max(map(len, group_by_map(dataset).values()))
    is_single_column = n_boxes > MAX_BOXES_OF_HALF_WIDTH
    n_rows = len(labels) * (len(MEASURE_TITLES) if is_single_column else 1)
    # Space for vertical labels in inches, by map. Horizontal labels need none.
    label_heights = {
        map_name: 0 if _fit_horizontally(names) else LETTER_INCHES * max(map(len, names))
        for map_name, names in labels.items()
    }
    label_height = sum(label_heights.values()) * (n_rows // len(labels))
    figure = Figure((FIGURE_WIDTH, BOX_MARGIN_HEIGHT + PANEL_HEIGHT * n_rows + label_height))
    tables = {measure: fitness.final(dataset, measure, last) for measure in MEASURE_TITLES}
    for axes, measure, conditions_on_map in make_panels(figure, dataset, is_single_column):
        for position, condition in enumerate(conditions_on_map):
            sample = tables[measure].sel(condition=condition.name).dropna("run").values
            if sample.size:
                draw_box(axes, position, sample, condition.style)
        map_name = conditions_on_map[0].map_name
        rotation = 90 if label_heights[map_name] else 0
        learners = [condition.learner for condition in conditions_on_map]
        axes.set_xticks(range(len(conditions_on_map)), learners, rotation=rotation)
        axes.tick_params(labelbottom=bool(labels[map_name]))
        axes.set_xlim(-0.6, len(conditions_on_map) - 0.4)
        axes.grid(visible=False, axis="x")
        names = [condition.name for condition in conditions_on_map]
        _draw_brackets(axes, names, _select_findings(results, measure))
    return figure


def _labels_by_map(dataset: xr.Dataset) -> dict[str, list[str]]:
    """Return the labels below the panels of each map.

    If all maps have the same learners and the labels are vertical, only the last map has labels.
    """
    groups = group_by_map(dataset)
    labels = {name: [item.learner for item in group] for name, group in groups.items()}
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


def _select_findings(results: Sequence[ClaimResult], measure: str) -> list[Finding]:
    findings = (finding for result in results for finding in result.findings)
    return [finding for finding in findings if finding.comparison.measure == measure]


class _Bracket(NamedTuple):
    """The p-value of two conditions, by the indices of their boxes in a panel."""

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
    top = find_top(axes)
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


def describe_p_values(dataset: xr.Dataset, results: Sequence[ClaimResult]) -> str:
    """Describe the p-values that `draw_fitness_boxes` draws, or return "" without any."""
    has_brackets = False
    baselines: dict[str, None] = {}
    for conditions in group_by_map(dataset).values():
        names = [condition.name for condition in conditions]
        for measure in MEASURE_TITLES:
            brackets = _make_brackets(names, _select_findings(results, measure))
            is_crowded = len(brackets) > MAX_BRACKETS
            has_brackets |= bool(brackets) and not is_crowded
            if is_crowded:
                baselines |= dict.fromkeys(names[index] for index in _find_baselines(brackets))
    correction = "the Mann-Whitney p-value, corrected for all claims (Holm)"
    texts = [f"Brackets show {correction}."] if has_brackets else []
    if baselines:
        texts.append(f"The text above a box is {correction}, against {' or '.join(baselines)}.")
    return " ".join(texts)


def _find_baselines(brackets: Sequence[_Bracket]) -> set[int]:
    """Return the indices of the boxes that are part of every bracket, usually one or none."""
    return set.intersection(*({bracket.left, bracket.right} for bracket in brackets))


def _draw_against_baseline(axes: Axes, brackets: list[_Bracket], top: float) -> None:
    """Write each p-value above a box, if all comparisons share a condition."""
    vertical: dict[str, Any] = {"rotation": 90, "ha": "center", "va": "bottom"}
    for baseline in _find_baselines(brackets):
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


def draw_measures_figure(report: ReportData) -> ReportFigure | None:
    if not report.model_measures:
        return None
    medians = []
    rows = []
    for measure in report.model_measures:
        values = {name: sample for name, sample in measure.values.items() if sample.size}
        texts = [
            f"{name} {format_number(float(np.median(sample)))}" for name, sample in values.items()
        ]
        medians.append(f"{measure.meaning}: {', '.join(texts)}")
        for name, sample in values.items():
            row = {"condition": name, "measure": measure.name}
            rows += [row | {"value": value} for value in sample.tolist()]
    return ReportFigure(
        title="Measures that the claims compare",
        caption=BOXES_NOTE,
        alternative=f"Box plots by condition, with medians over runs: {'; '.join(medians)}.",
        figure=draw_measures(report.data, report.model_measures),
        table=rows,
    )


@styled
def draw_measures(dataset: xr.Dataset, measures: Sequence[ModelMeasure]) -> Figure:
    """Draw one or more measures, each in a panel, with a box per condition and a point per run."""
    conditions = style_conditions(dataset)
    conditions_by_map = group_by_map(dataset)
    maps = list(conditions_by_map)
    learners = list(dict.fromkeys(condition.learner for condition in conditions))
    # A gap of one position separates the maps.
    positions_per_map = len(learners) + 1
    positions = {
        condition.name: maps.index(condition.map_name) * positions_per_map
        + learners.index(condition.learner)
        for condition in conditions
    }
    has_maps = maps != [""]
    # (positions, labels): a tick per learner, or if there are maps, a tick per group of boxes.
    if not has_maps:
        ticks = ([float(position) for position in positions.values()], learners)
    else:
        centers = [
            float(np.mean([positions[condition.name] for condition in on_map]))
            for on_map in conditions_by_map.values()
        ]
        ticks = (centers, maps)
    figure = Figure((FIGURE_WIDTH, 0.5 + 2.6 * len(measures)))
    panels = figure.subplots(len(measures), squeeze=False).flat
    for axes, measure in zip(panels, measures, strict=True):
        for condition in conditions:
            values = measure.values[condition.name]
            if values.size:
                draw_box(axes, positions[condition.name], values, condition.style)
        title = measure.meaning[0].upper() + measure.meaning[1:]
        axes.set_title(title)
        axes.set_xticks(*ticks)
        axes.set_xlim(-0.8, max(positions.values()) + 0.8)
        axes.grid(visible=False, axis="x")
    if has_maps and len(learners) > 1:
        draw_legend(figure, {item.learner: item.style for item in conditions})
    return figure
