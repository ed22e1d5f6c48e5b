"""Class that declares the evaluation of an assay, and functions that all evaluations share.

The other modules of this package declare evaluations, and `load_evaluations` imports all of them.
The report shows no assay without an evaluation.

A quantity of an assay has one value per run: an average over the agents and, if the assay has
generations, over a window of generations. Fitness is the variable `energy`: for MiniWorld, the
energy of the items that an agent eats.
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

from baldwinlab.analysis.assays.criteria import Quantity, Terms, fill_terms
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.experiment.conditions import Factors
from baldwinlab.experiment.toml import from_toml

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from baldwinlab.analysis.report.sections import Section

# Datasets of one assay by condition, and of all assays: `assays["innate"]["evo/A"]`.
Stored = Mapping[str, xr.Dataset]
Assays = Mapping[str, Stored]
# Label of newborns with random genomes on the coordinate `newborns`.
RANDOM_NEWBORNS: Final = "random genome"
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
    declared = [
        value
        for module in iter_modules([str(Path(__file__).parent)])
        for value in vars(import_module(f"{__package__}.{module.name}")).values()
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


def parse_experiments(assays: Assays) -> dict[str, Experiment]:
    """Return the experiment of every condition with a stored assay, by condition."""
    datasets = {name: data for stored in assays.values() for name, data in stored.items()}
    return {
        name: from_toml(data.attrs["experiment"], source=f"the experiment of {name}", lenient=True)
        for name, data in datasets.items()
    }


def read_factors(data: xr.Dataset) -> Factors:
    """Return the factors of the condition of an assay, from the attributes of `read_assays`."""
    return Factors(*(data.attrs[name] for name in Factors._fields))


def weight_distances(innate: xr.Dataset) -> dict[str, xr.DataArray]:
    """Return mean distances over agents (run, generation) between the weights at birth and death.

    The key "distance" is for all weights, and "distance, LAYER" for a layer. The dictionary is
    empty if the model has no weights.
    """
    if "distance" not in innate:
        return {}
    distance = innate["distance"]
    # The layers are parts of one vector, so the squares add up. Without a value, the sum is NaN.
    total_distance = (distance**2).sum("layer", min_count=1) ** 0.5
    layer_distances = {
        f"distance, {layer}": distance.sel(layer=layer).mean("agent")
        for layer in distance["layer"].values
    }
    return {"distance": total_distance.mean("agent"), **layer_distances}


def drop_labels(values: xr.DataArray) -> xr.DataArray:
    """Return values (run) with only the coordinate `run`. `xr.align` needs this coordinate."""
    return values.drop_vars(set(values.coords) - {"run"})


def compute_share(part: xr.DataArray, total: xr.DataArray) -> xr.DataArray:
    """Return part / total, or NaN if the total is not above 0."""
    return part / total.where(total > 0)


def parse_generation(newborns: str) -> int:
    """Return the generation at the end of a name of newborns: "generation 99" -> 99."""
    return int(newborns.split()[-1])


def find_learning_conditions(
    assays: Assays, experiments: Mapping[str, BaseExperiment]
) -> list[str]:
    """Return the conditions that evolve and learn, among the experiments of stored assays."""
    # Assays compare only a condition that evolves and learns with a control.
    compared = {
        name
        for stored in assays.values()
        for name, data in stored.items()
        if "control_experiment" in data.attrs
    }
    innate = assays.get("innate", {})
    return [
        name
        for name, experiment in experiments.items()
        if name in compared or evolves_and_learns(experiment, innate.get(name))
    ]


def evolves_and_learns(experiment: BaseExperiment, innate: xr.Dataset | None) -> bool:
    """Return whether a condition evolves and learns.

    For a model other than MiniWorld, the stored assay `innate` decides, because the model may not
    be loaded. Without learning, the fitness with learning on is NaN.
    """
    if experiment.evolution.inheritance == "none":
        return False
    if isinstance(experiment, Experiment):
        return experiment.learns
    return innate is not None and bool(innate["energy"].sel(life="on").notnull().any())
