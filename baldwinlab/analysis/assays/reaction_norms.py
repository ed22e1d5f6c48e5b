"""Evaluation of the assay `reaction-norms`: intercept and slope over the amount of learning.

The coordinate `factor` is the multiple of the amount of learning in the study.

References
----------
.. [1] C. H. Waddington, "Genetic assimilation of an acquired character", Evolution 7 (1953).
.. [2] R. Lande, "Adaptation to an extraordinary environment by evolution of phenotypic plasticity
   and genetic assimilation", Journal of Evolutionary Biology 22 (2009).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from baldwinlab.analysis.assays.evaluation import (
    BANDS_NOTE,
    AssayEvaluation,
    AssayFigure,
    EffectTable,
    QuantityValues,
    Stored,
)
from baldwinlab.analysis.assays.panels import (
    NEWBORN_STYLES,
    draw_medians,
    make_blocks_of_conditions,
)
from baldwinlab.analysis.figures.curves import draw_legend_of_panels, label_blocks
from baldwinlab.analysis.figures.style import styled

QUANTITY_PREFIX: Final = "reaction norm: "
PARAMETERS: Final = ("intercept", "slope")
MEASURES: Final = tuple(f"{QUANTITY_PREFIX}{name}" for name in PARAMETERS)
LAST_MINUS_FIRST: Final = "last minus first generation"


def compute_parameters(data: xr.Dataset) -> dict[str, xr.DataArray]:
    """Return "intercept" and "slope" (run, generation) of reaction norms, in the unit of fitness.

    The intercept is the mean fitness at the factor 0, without learning. The slope is the mean
    fitness at the factor 1 minus the intercept. The norm need not be linear. See Lande 2009.
    """
    fitness = data["energy"].mean("agent")
    innate, learned = (fitness.sel(factor=factor, drop=True) for factor in (0, 1))
    return {"intercept": innate, "slope": learned - innate}


def compute_quantities(data: xr.Dataset, last: int) -> Iterator[QuantityValues]:
    """Yield the values (run) of both parameters, their changes, and all points of the norms.

    Assimilation raises the intercept and lowers the slope. A constant that is added to fitness does
    not affect either change.
    """
    generations = data["generation"].values.tolist()
    for parameter, values in compute_parameters(data).items():
        name = f"{QUANTITY_PREFIX}{parameter}"
        for generation in generations:
            yield (name, f"generation {generation}"), values.sel(generation=generation)
        start, end = (values.isel(generation=index, drop=True) for index in (0, -1))
        yield (name, LAST_MINUS_FIRST), end - start
    fitness = data["energy"].mean("agent")
    for factor in data["factor"].values.tolist():
        for generation in generations:
            point = fitness.sel(factor=factor, generation=generation)
            name = f"{QUANTITY_PREFIX}fitness with {factor:g} times the learning"
            yield (name, f"generation {generation}"), point


@styled
def draw_norms(stored: Stored, names: Sequence[str], unit: str) -> Figure:
    """Draw fitness by the multiple of the amount of learning: a panel per condition."""
    figure, grid = make_blocks_of_conditions(stored, names, 1, 2.3)
    for (axes,), name in zip(grid, names, strict=True):
        data = stored[name]
        fitness = data["energy"].mean("agent")
        labels = [f"{factor:g}" for factor in data["factor"].values]
        # The factors are 0 and powers of 2, so they are evenly spaced on the axis.
        positions = fitness.assign_coords(factor=np.arange(len(labels)))
        generations = data["generation"].values.tolist()
        for generation, style in zip(generations, NEWBORN_STYLES, strict=False):
            norm = positions.sel(generation=generation)
            draw_medians(axes, norm, style, f"generation {generation}", "factor")
        axes.set_xticks(range(len(labels)), labels)
        axes.set_xlabel("multiple of the amount of learning")
    label_blocks(grid, unit)
    draw_legend_of_panels(figure, grid[:, 0], 4)
    return figure


TABLE: Final = EffectTable(
    title="Reaction norms over learning",
    explanation=(
        "The intercept is the fitness without learning. The slope is the fitness with the learning "
        "of the study minus the intercept. In genetic assimilation, the intercept rises and the "
        "slope falls."
    ),
    time="Time",
    columns=PARAMETERS,
    measures={"fitness": MEASURES},
)
EVALUATION: Final = AssayEvaluation(
    assay="reaction-norms",
    order=70,
    compute_quantities=compute_quantities,
    figures=(
        AssayFigure(
            name="learning-norms",
            title="Reaction norms over learning",
            caption=(
                "Fitness of the average agent of four generations, by the multiple of the learning "
                "rate, or of the setting that the model declares. 0 is learning off, and 1 is the "
                "setting of the study. Genetic assimilation raises the fitness at 0 and makes the "
                f"line flat. {BANDS_NOTE}"
            ),
            draw=draw_norms,
            measures=MEASURES,
        ),
    ),
    table=TABLE,
)
