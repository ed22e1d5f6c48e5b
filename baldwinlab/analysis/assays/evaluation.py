"""Declaration of the evaluation of an assay: its quantities and its part of the report.

The evaluations in the modules of this package are found here. An assay without one is stored, and
not shown.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Final, NamedTuple

import xarray as xr

from baldwinlab.analysis.assays.criteria import Terms, fill_terms
from baldwinlab.analysis.assays.values import Assays, Quantity, Stored

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from baldwinlab.analysis.report.sections import Section

# A quantity with one value per run.
QuantityValues = tuple[Quantity, xr.DataArray]
BANDS_NOTE: Final = (
    "Lines are medians over runs. Bands are their 95 % intervals (sign test), shown for six runs "
    "or more."
)


class AssayFigure(NamedTuple):
    """A figure of an assay."""

    name: str
    title: str
    # It may contain the placeholders of `Terms`, as the names of measures may.
    caption: str
    # Draws conditions by name, with the label of fitness.
    draw: Callable[[Stored, Sequence[str], str], Figure]
    # Measures in the alternative text.
    measures: Sequence[str]


class EffectTable(NamedTuple):
    """A table of effects, with one row per condition, time and measure."""

    title: str
    explanation: str
    # Heading of the time.
    time: str
    columns: Sequence[str]
    # Measure of each column, by the name of a row.
    measures: Mapping[str, Sequence[str]]


@dataclass(frozen=True)
class AssayEvaluation:
    """Quantities of an assay, and its part of the report."""

    assay: str
    # Assays with lower numbers come first in the report.
    order: int
    # Yields quantities of the dataset of a condition. The number is that of generations in the
    # windows "first" and "last".
    compute_quantities: Callable[[xr.Dataset, int], Iterator[QuantityValues]] | None = None
    # Names of measures in the report, if they differ.
    measure_names: Mapping[str, str] = field(default_factory=dict)
    figures: Sequence[AssayFigure] = ()
    table: EffectTable | None = None
    # Makes a section of its own from the datasets by condition, and saves figures in a folder.
    make_section: Callable[[Stored, Path], Section] | None = None


@cache
def load_evaluations() -> Mapping[str, AssayEvaluation]:
    """Return the evaluations that the modules of this package declare, by assay, in order."""
    modules = [
        import_module(f"{__package__}.{module.name}")
        for module in iter_modules([str(Path(__file__).parent)])
    ]
    declared = [
        value
        for module in modules
        for value in vars(module).values()
        if isinstance(value, AssayEvaluation)
    ]
    declared.sort(key=lambda evaluation: evaluation.order)
    return {evaluation.assay: evaluation for evaluation in declared}


def select_with_quantities(assays: Assays) -> Assays:
    """Return the assays whose quantities are compared within conditions."""
    evaluations = load_evaluations()
    return {
        name: stored
        for name, stored in assays.items()
        if name in evaluations and evaluations[name].compute_quantities
    }


def compute_quantities(assays: Assays, condition: str, last: int) -> dict[Quantity, xr.DataArray]:
    """Return all quantities of a condition.

    `last`: number of generations in the windows "first" and "last", at least 1. The window
    "throughout" has all generations. Returns values (run), NaN if they are undefined.
    """
    if last < 1:
        raise ValueError(f"last = {last} must be at least 1 generation")
    return {
        quantity: values
        for name, evaluation in load_evaluations().items()
        if evaluation.compute_quantities and condition in assays.get(name, {})
        for quantity, values in evaluation.compute_quantities(assays[name][condition], last)
    }


def name_measure(measure: str, terms: Terms) -> str:
    """Return the name of a measure in figures and tables."""
    for evaluation in load_evaluations().values():
        if name := evaluation.measure_names.get(measure):
            return fill_terms(name, terms)
    return measure


def make_own_sections(assays: Assays, folder: Path) -> list[Section]:
    """Make the sections of the assays that have their own, and save their figures in a folder."""
    return [
        evaluation.make_section(assays[name], folder)
        for name, evaluation in load_evaluations().items()
        if evaluation.make_section and name in assays
    ]
