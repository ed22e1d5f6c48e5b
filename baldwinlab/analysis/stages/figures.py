"""Figures of a study in stages: all runs as points, and the specification curve."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from baldwinlab.analysis.figures.style import (
    BLUE,
    DARK_GRAY,
    FIGURE_WIDTH,
    GRAY,
    ORANGE,
    spread_points,
    styled,
)
from baldwinlab.analysis.stages.noise_comparison import NoiseComparison
from baldwinlab.analysis.stages.specification_curve import SpecificationResults
from baldwinlab.analysis.statistics.samples import Sample

# Height of a row, and of the title and the axis of a panel, in inches.
ROW_HEIGHT: Final = 0.2
AXIS_HEIGHT: Final = 0.75
# Share of a row that points cover.
POINT_SPREAD: Final = 0.6
# Values up to this number of items are on a linear scale, and larger ones on a logarithmic scale.
LINEAR_LIMIT: Final = 1.0
TICKS: Final = (-1000, -100, -10, 0, 10, 100, 1000)
N_COLUMNS: Final = 2


@styled
def draw_runs(rows: Sequence[NoiseComparison], noise_controls: Sequence[str]) -> Figure:
    """Draw the fitness on unseen maps of all runs, with a panel for each map.

    The figure has a row per learner: a point per run, the median as a line, and the number of runs
    that take off.
    """
    maps = list(dict.fromkeys(row.map for row in rows))
    n_columns = min(N_COLUMNS, len(maps))
    n_lines = -(-len(maps) // n_columns)
    n_learners = max(sum(row.map == name for row in rows) for name in maps)
    height = n_lines * (AXIS_HEIGHT + ROW_HEIGHT * n_learners)
    figure = Figure((FIGURE_WIDTH, height))
    grid = figure.subplots(n_lines, n_columns, sharey=True, squeeze=False)
    for axes in grid.flat[len(maps) :]:
        axes.set_visible(False)
    for axes, map_name in zip(grid.flat, maps, strict=False):
        _draw_map(axes, [row for row in rows if row.map == map_name], noise_controls)
        axes.set_title(f"Map {map_name}" if map_name else "", loc="left", fontweight="bold")
        _scale_items(axes, np.concatenate([row.values for row in rows]))
    return figure


def _draw_map(axes: Axes, rows: Sequence[NoiseComparison], noise_controls: Sequence[str]) -> None:
    for position, row in enumerate(rows):
        color = ORANGE if row.learner in noise_controls else BLUE
        heights = position + POINT_SPREAD * spread_points(row.values.size)
        axes.plot(row.values, heights, ".", color=color, ms=3, alpha=0.6, mew=0)
        axes.plot([row.median] * 2, [position - 0.4, position + 0.4], color="black", lw=1.5)
        axes.annotate(
            f"{row.hurdle.takeoffs}/{row.hurdle.runs}",
            (1, position),
            xycoords=("axes fraction", "data"),
            xytext=(3, 0),
            textcoords="offset points",
            va="center",
            fontsize=8,
            color=DARK_GRAY,
        )
    axes.set_yticks(range(len(rows)), [row.learner for row in rows])
    axes.set_ylim(len(rows) - 0.5, -0.5)


def _scale_items(axes: Axes, values: Sample) -> None:
    """Set a scale of items that shows zero, one and hundreds."""
    axes.set_xscale("symlog", linthresh=LINEAR_LIMIT)
    # A margin keeps points off the frame.
    low = min(1.5 * float(values.min()), -0.2)
    axes.set_xlim(low, max(1.5 * float(values.max()), 10))
    ticks = [tick for tick in TICKS if axes.get_xlim()[0] <= tick <= axes.get_xlim()[1]]
    axes.set_xticks(ticks, [f"{tick}".replace("-", "−") for tick in ticks])
    axes.minorticks_off()
    axes.set_xlabel("items on unseen maps")


@styled
def draw_specifications(results: SpecificationResults, noise_controls: Sequence[str]) -> Figure:
    """Draw the rank of each learner in each specification, and the differences to the best noise.

    `results`: the learners, sorted by median rank. The figure has a row per learner and a point per
    specification. Lines are medians.
    """
    n_learners = len(results.learners)
    figure = Figure((FIGURE_WIDTH, AXIS_HEIGHT + ROW_HEIGHT * n_learners))
    rank_axes, effect_axes = figure.subplots(1, 2, sharey=True)
    for position, row in enumerate(results.learners):
        color = ORANGE if row.learner in noise_controls else BLUE
        for axes, values in ((rank_axes, row.ranks), (effect_axes, row.effects)):
            heights = position + POINT_SPREAD * spread_points(values.size)
            axes.plot(values, heights, ".", color=color, ms=4, alpha=0.6, mew=0)
            median = float(np.median(values))
            axes.plot([median] * 2, [position - 0.4, position + 0.4], color="black", lw=1.5)
    effect_axes.axvline(0, color=GRAY, lw=0.8)
    rank_axes.set_yticks(range(n_learners), [row.learner for row in results.learners])
    rank_axes.set_ylim(n_learners - 0.5, -0.5)
    rank_axes.set_title("Rank", loc="left", fontweight="bold")
    rank_axes.set_xlabel("rank (1 = most items)")
    effect_axes.set_title("Difference to the best noise control", loc="left", fontweight="bold")
    _scale_items(effect_axes, np.concatenate([row.effects for row in results.learners]))
    return figure
