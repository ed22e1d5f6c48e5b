"""Class that declares the evaluation of an assay: quantities, figures and tables of a report.

The other modules of this package declare evaluations, and `load_evaluations` imports all of them.
The report shows no assay without an evaluation.
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
    # Text with the placeholders of `Terms`, for example "{weights}".
    caption: str
    # Function of the datasets by condition, the drawn conditions, and the label of fitness.
    draw: Callable[[Stored, Sequence[str], str], Figure]
    # The alternative text lists the medians of these measures.
    measures: Sequence[str]


class EffectTable(NamedTuple):
    """A table of effects, with one row per condition, time and measure."""

    title: str
    explanation: str
    # Heading of the column of times, for example "Start".
    time: str
    columns: Sequence[str]
    # Measures in the order of `columns`, by the name in the column "Measure".
    measures: Mapping[str, Sequence[str]]


@dataclass(frozen=True)
class AssayEvaluation:
    """Quantities of an assay, and the figures, table and section of a report that show them."""

    assay: str
    # Assays with lower numbers come first in the report.
    order: int
    # Function that yields quantities. The arguments are the dataset of a condition, and the number
    # of generations in the windows "first" and "last".
    compute_quantities: Callable[[xr.Dataset, int], Iterator[QuantityValues]] | None = None
    # Names of measures in the report. A measure without an entry has its own name there.
    measure_names: Mapping[str, str] = field(default_factory=dict)
    figures: Sequence[AssayFigure] = ()
    table: EffectTable | None = None
    # Function of the datasets by condition, of the folder for figures, and of the instruction that
    # adds runs. It returns a separate section of the report.
    make_section: Callable[[Stored, Path, str], Section] | None = None


@cache
def load_evaluations() -> Mapping[str, AssayEvaluation]:
    """Return the evaluations of all modules of this package by assay, in the report's order."""
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
    """Return the assays with quantities, which criteria compare within a condition."""
    evaluations = load_evaluations()
    return {
        name: stored
        for name, stored in assays.items()
        if name in evaluations and evaluations[name].compute_quantities
    }


def compute_quantities(assays: Assays, condition: str, last: int) -> dict[Quantity, xr.DataArray]:
    """Return the values (run) of all quantities of a condition. NaN marks an undefined value.

    `last`: number of generations in the windows "first" and "last", at least 1. The window
    "throughout" has all generations.
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


def make_own_sections(assays: Assays, folder: Path, instruction: str) -> list[Section]:
    """Make the separate sections of assays, for example of `opponents`, and save the figures."""
    return [
        evaluation.make_section(assays[name], folder, instruction)
        for name, evaluation in load_evaluations().items()
        if evaluation.make_section and name in assays
    ]
