"""Evaluation of the assay `descent`: last common ancestors, and effective number of founders."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import xarray as xr
from matplotlib.figure import Figure

from baldwinlab.analysis.assays.evaluation import (
    BANDS_NOTE,
    AssayEvaluation,
    AssayFigure,
    QuantityValues,
    Stored,
    read_factors,
)
from baldwinlab.analysis.assays.panels import draw_medians, label_learners, style_learners
from baldwinlab.analysis.figures.curves import start_at_zero
from baldwinlab.analysis.figures.style import FIGURE_WIDTH, label_generations, styled
from baldwinlab.experiment.conditions import title_map


def compute_quantities(data: xr.Dataset, last: int) -> Iterator[QuantityValues]:
    for name in ("common_ancestor_age", "effective_ancestors"):
        measure = name.replace("_", " ")
        yield (measure, "last"), data[name].isel(generation=-1)


@styled
def draw_descent(stored: Stored, names: Sequence[str], unit: str) -> Figure:
    """Draw the age of the last common ancestor and the effective ancestors: two panels per map."""
    # Without inheritance, agents have no ancestors, and the values are NaN.
    stored = {
        name: data for name, data in stored.items() if data["effective_ancestors"].notnull().any()
    }
    factors = {name: read_factors(data) for name, data in stored.items()}
    styles = style_learners(stored)
    maps = list(dict.fromkeys(condition.map for condition in factors.values()))
    figure = Figure((FIGURE_WIDTH, 0.5 + 2.2 * len(maps)))
    grid = figure.subplots(len(maps), 2, squeeze=False)  # [map, measure]
    measures = {
        "common_ancestor_age": "generations since the\nlast common ancestor",
        "effective_ancestors": "effective ancestors",
    }
    for row, map_name in zip(grid, maps, strict=True):
        conditions_on_map = [name for name in stored if factors[name].map == map_name]
        for axes, (measure, label) in zip(row, measures.items(), strict=True):
            for name in conditions_on_map:
                learner = factors[name].learner
                draw_medians(axes, stored[name][measure], styles[learner], learner)
            axes.set_title(title_map(map_name))
            axes.set_ylabel(label)
            start_at_zero(axes)
            label_generations(axes)
    label_learners(figure, styles, stored)
    return figure


EVALUATION: Final = AssayEvaluation(
    assay="descent",
    order=60,
    compute_quantities=compute_quantities,
    measure_names={
        "common ancestor age": "generations since the last common ancestor",
    },
    figures=(
        AssayFigure(
            name="descent",
            title="Common descent",
            caption=(
                "Left: generations since the last common ancestor of all agents. Right: effective "
                f"number of founders in the gene pool (1 / sum of squared shares). {BANDS_NOTE}"
            ),
            draw=draw_descent,
            measures=("common ancestor age", "effective ancestors"),
        ),
    ),
)
