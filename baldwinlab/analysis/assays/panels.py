"""Panels of the figures of assays: blocks of conditions, medians over runs, and learners."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy.typing as npt
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from baldwinlab.analysis.assays.evaluation import Stored, read_factors
from baldwinlab.analysis.figures.curves import draw_curve, make_blocks
from baldwinlab.analysis.figures.line_labels import label_lines
from baldwinlab.analysis.figures.style import LINE_STYLES, MARKERS, SeriesStyle, choose_style
from baldwinlab.analysis.palette import NEWBORN_COLORS
from baldwinlab.analysis.statistics.intervals import interval_of_median

# One style per kind of newborns, for example a generation, from the first to the last.
NEWBORN_STYLES: Final = [
    SeriesStyle(color, line, marker)
    for color, line, marker in zip(NEWBORN_COLORS, LINE_STYLES[::-1], MARKERS, strict=False)
]


def make_blocks_of_conditions(
    stored: Stored, names: Sequence[str], n_rows: int, row_height: float
) -> tuple[Figure, npt.NDArray[Any]]:
    """Return a figure and its panels [condition, row]. `row_height` is in inches."""
    return make_blocks([read_factors(stored[name]).title for name in names], n_rows, row_height)


def draw_medians(
    axes: Axes, values: xr.DataArray, style: SeriesStyle, label: str = "", dim: str = "generation"
) -> None:
    """Draw the medians over runs with their 95 % intervals."""
    draw_curve(axes, interval_of_median(values), style, label, dim)


def style_learners(stored: Stored) -> dict[str, SeriesStyle]:
    """Return the style of each learner, such as "evo+self-taught", equal in all figures."""
    # The attribute lists all learners of the study, also those without this assay.
    learners = [name for data in stored.values() for name in data.attrs.get("learners", ())]
    learners += [read_factors(data).learner for data in stored.values()]
    return {
        name: choose_style(learner_index)
        for learner_index, name in enumerate(dict.fromkeys(learners))
    }


def label_learners(figure: Figure, styles: Mapping[str, SeriesStyle], stored: Stored) -> None:
    """Label the lines of the learners of some conditions."""
    learners = {read_factors(data).learner for data in stored.values()}
    label_lines(figure, {name: style for name, style in styles.items() if name in learners})
