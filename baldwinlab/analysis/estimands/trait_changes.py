"""Report section on changes of the innate trait: parts of a change, and predicted changes.

References
----------
.. [1] G. R. Price, "Selection and covariance", Nature 227 (1970).
.. [2] D. S. Falconer and T. F. C. Mackay, "Introduction to quantitative genetics", 4th edition
   (1996).
.. [3] G. Mayley, "Landscapes, learning costs, and genetic assimilation", Evolutionary Computation 4
   (1996).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from baldwinlab.analysis.assays.evaluation import read_factors
from baldwinlab.analysis.estimands.expected_offspring import SCHEMES, expect_offspring
from baldwinlab.analysis.estimands.quantitative_genetics import (
    PARTS,
    correlate_distances,
    estimate_heritability,
    partition_change,
)
from baldwinlab.analysis.estimands.traits import Trait, read_record, select_innate_trait
from baldwinlab.analysis.figures.curves import (
    draw_curve,
    draw_legend_of_panels,
    label_blocks,
    make_blocks,
)
from baldwinlab.analysis.figures.style import (
    BLACK,
    BLUE,
    ORANGE,
    SeriesStyle,
    label_generations,
    styled,
)
from baldwinlab.analysis.palette import MID_GRAY, PURPLE
from baldwinlab.analysis.report.sections import ReportFigure, Section, render, save_and_inline
from baldwinlab.analysis.report.tables import Table, add_detail, tabulate
from baldwinlab.analysis.results.numbers import format_estimate, format_number, to_csv
from baldwinlab.analysis.statistics import median_interval
from baldwinlab.analysis.statistics.intervals import interval_of_median, tabulate_interval
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.experiment import BaseExperiment

# The sum of the parts minus the change: 0 except for rounding errors.
RESIDUAL: Final = "identity residual"
CORRELATION: Final = "genotype-phenotype correlation"
GENETICS: Final = ("heritability", "additive variance", "predicted response", "response")
# Largest number of agents in a correlation of distances, which compares all pairs of agents.
MAX_AGENTS: Final = 300
TITLE: Final = "What changed the mean in each generation"
ANCHOR: Final = "trait-changes"
CSV_FILE: Final = "trait-changes.csv"
QUANTITIES: Final = ("change", *PARTS, RESIDUAL, *GENETICS, CORRELATION)
CSV_COLUMNS: Final = ("condition", "trait", "unit", "quantity", "runs", "median", "low", "high")
PART_COLORS: Final = dict(zip(PARTS, (BLUE, ORANGE, MID_GRAY, PURPLE), strict=True))
OBSERVED: Final = SeriesStyle(BLACK, "-", "o")
PREDICTED: Final = SeriesStyle(BLUE, "--", "s")
# A figure with more panels is not readable. The table has all conditions.
MAX_CONDITIONS_IN_FIGURES: Final = 8


class TraitChanges(NamedTuple):
    """Changes of the mean of an innate trait."""

    trait: str  # Meaning of the trait.
    unit: str
    # "change", the parts of `PARTS`, "identity residual" and the quantities of `GENETICS` (run,
    # generation), and "genotype-phenotype correlation" (run).
    values: xr.Dataset


def find_obstacle(experiment: BaseExperiment) -> str:
    """Return why the changes of a condition cannot be partitioned, as a sentence, or ""."""
    selection = experiment.evolution.selection
    if experiment.population.species:
        return "The agents of a generation belong to several species."
    if experiment.may_stop:
        return "A run can end before its last generation."
    if selection not in SCHEMES:
        return f"The expected number of offspring under the selection {selection} is not known."
    return ""


def measure_changes(
    runs: xr.Dataset,
    innate: xr.Dataset,
    experiment: BaseExperiment,
    genotypes: xr.DataArray | None = None,
) -> TraitChanges:
    """Partition the changes of the innate trait, and predict the changes from the heritability.

    `find_obstacle` returns "" for the experiment. `genotypes` are genomes (run, agent, gene) of one
    generation, a scalar coordinate. Fitness with learning is the phenotype of the correlation. The
    result has no generations if no two successive generations have the trait. See Price 1970;
    Falconer and Mackay 1996; Mayley 1996.
    """
    runs = runs.sel(run=innate["run"])
    trait = _select_trait(runs, innate, experiment)
    offspring = {
        life: expect_offspring(innate["energy"].sel(life=life, drop=True), experiment)
        for life in ("off", "on")
    }
    partition = partition_change(trait.values, runs["parents"], offspring["off"], offspring["on"])
    residual = sum(partition[name] for name in PARTS) - partition["change"]
    genetics = estimate_heritability(trait.values, runs["parents"])[list(GENETICS)]
    values = partition.assign({RESIDUAL: residual}).merge(genetics, join="outer", compat="override")
    correlation = xr.full_like(runs["run"], np.nan, dtype=np.float64)  # NaN without genotypes.
    if genotypes is not None:
        fitness = innate["energy"].sel(life="on", generation=genotypes["generation"], drop=True)
        correlation = _correlate(genotypes.drop_vars("generation"), fitness)
    return TraitChanges(trait.name, trait.unit, values.assign({CORRELATION: correlation}))


def average_changes(changes: TraitChanges) -> dict[str, xr.DataArray]:
    """Return the mean of each quantity over generations (run), and the largest residual's size."""
    averages = {
        str(name): values.mean("generation") if "generation" in values.dims else values
        for name, values in changes.values.items()
    }
    averages[RESIDUAL] = abs(changes.values[RESIDUAL]).max("generation")
    return averages


def _select_trait(runs: xr.Dataset, innate: xr.Dataset, experiment: BaseExperiment) -> Trait:
    """Return the innate trait, in all generations if the model records it."""
    model = experiment.loaded_model
    if model is not None and model.innate_trait in runs:
        return read_record(runs, model, model.innate_trait)
    return select_innate_trait(runs, innate, experiment)


def _correlate(genotypes: xr.DataArray, fitness: xr.DataArray) -> xr.DataArray:
    """Return `correlate_distances` (run) for up to `MAX_AGENTS` agents, evenly spaced by index."""
    n_agents = genotypes.sizes["agent"]
    numbers = np.unique(np.linspace(0, n_agents - 1, min(n_agents, MAX_AGENTS)).astype(int))
    phenotypes = fitness.expand_dims("feature", axis=-1)
    return correlate_distances(genotypes.isel(agent=numbers), phenotypes.isel(agent=numbers))


def make_section(
    changes: Mapping[str, TraitChanges],
    innate: Mapping[str, xr.Dataset],
    obstacles: Mapping[str, str],
    directory: Path,
) -> Section:
    """Make the section on the changes of innate traits, and write `trait-changes.csv` and figures.

    `obstacles`: by condition without measured changes, a sentence with the reason.
    """
    rows = [row for name, entry in changes.items() for row in _tabulate(name, entry)]
    write_atomically(directory / CSV_FILE, to_csv(CSV_COLUMNS, rows))
    numbers: dict[str, dict[str, dict[str, Any]]] = {name: {} for name in changes}
    for row in rows:
        numbers[row["condition"]][row["quantity"]] = row
    drawn = list(changes)[:MAX_CONDITIONS_IN_FIGURES]
    figures = _make_figures(changes, innate, drawn, numbers) if drawn else []
    body = render(
        "estimands/trait_changes.html",
        numbers=_make_table(changes, numbers) if numbers else None,
        obstacles=obstacles,
        figures=[save_and_inline(figure, directory / "figures") for figure in figures],
        omitted=list(changes)[MAX_CONDITIONS_IN_FIGURES:],
    )
    return Section(anchor=ANCHOR, title=TITLE, body=body)


def _tabulate(condition: str, changes: TraitChanges) -> list[dict[str, Any]]:
    """Return a row per quantity with the keys `CSV_COLUMNS`, such as the median over runs."""
    rows = []
    for quantity, values in average_changes(changes).items():
        defined = values.values[np.isfinite(values.values)]
        low, high = median_interval(defined) if defined.size else (np.nan, np.nan)
        median = float(np.median(defined)) if defined.size else np.nan
        names = (condition, changes.trait, changes.unit, quantity)
        row = dict(zip(CSV_COLUMNS, (*names, defined.size, median, low, high), strict=True))
        rows.append(row)
    return sorted(rows, key=lambda row: QUANTITIES.index(row["quantity"]))


def _make_table(
    changes: Mapping[str, TraitChanges], numbers: Mapping[str, Mapping[str, Mapping[str, Any]]]
) -> Table:
    headings = [add_detail(name, entry.trait) for name, entry in changes.items()]
    rows = [
        [quantity, *(_format_row(table[quantity]) for table in numbers.values())]
        for quantity in QUANTITIES
    ]
    return tabulate("Changes of the innate trait", ["Quantity"], headings, rows)


def _format_row(row: Mapping[str, Any]) -> str:
    """Return a median with its interval. Most changes are small, so they have three digits."""
    if not row["runs"]:
        return "undefined"
    return format_estimate(row["median"], row["low"], row["high"], digits=3).replace("-", "−")


def _make_figures(
    changes: Mapping[str, TraitChanges],
    innate: Mapping[str, xr.Dataset],
    names: Sequence[str],
    numbers: Mapping[str, Mapping[str, Mapping[str, Any]]],
) -> list[ReportFigure]:
    """Return two figures. `numbers` has the rows of `_tabulate` by condition and quantity."""

    def describe(quantities: Sequence[str]) -> str:
        texts = [
            f"{name}: {quantity} {format_number(numbers[name][quantity]['median'])}"
            for name in names
            for quantity in quantities
        ]
        return "; ".join(texts)

    commands = ("baldwinlab assay . --assays innate",)
    partition = ReportFigure(
        name="price-partition",
        title="Parts of the change of the mean",
        caption=(
            "Parts of the change of the innate trait's mean from each generation to the next, by "
            "Price's equation. Parts above 0 and below 0 are stacked separately. They add up to "
            "the observed change, the line. All values are means over runs, because medians do "
            "not add up."
        ),
        alternative=f"Parts of the change. Means over generations: {describe(PARTS)}.",
        figure=draw_partition(changes, innate, names),
        table=_tabulate_generations(changes, names, ("change", *PARTS)),
        commands=commands,
    )
    response = ReportFigure(
        name="breeders-equation",
        title="Heritability, predicted and observed response",
        caption=(
            "Top: response to selection that the breeder's equation predicts, heritability times "
            "selection differential, and the observed change of the mean. Bottom: heritability, "
            "the slope of children on the mean of their parents. Lines are medians over runs. "
            "Bands are their 95 % intervals (sign test), shown for six runs or more."
        ),
        alternative=f"Heritability and response. Means over generations: {describe(GENETICS)}.",
        figure=draw_response(changes, innate, names),
        table=_tabulate_generations(changes, names, GENETICS),
        commands=commands,
    )
    return [partition, response]


@styled
def draw_partition(
    changes: Mapping[str, TraitChanges], innate: Mapping[str, xr.Dataset], names: Sequence[str]
) -> Figure:
    """Draw the stacked parts of the change of the mean, and the observed change."""
    figure, grid = make_blocks([read_factors(innate[name]).title for name in names], 1, 2.4)
    for (axes,), name in zip(grid, names, strict=True):
        means = changes[name].values[["change", *PARTS]].mean("run")
        _stack_parts(axes, means)
        label_generations(axes)
    label_blocks(grid, "change of the mean\ntrait per generation")
    draw_legend_of_panels(figure, grid[:, 0], 3)
    return figure


def _stack_parts(axes: Axes, means: xr.Dataset) -> None:
    """Draw the parts (generation) from 0 upward and downward, and their sum as a line."""
    generations = means["generation"].values
    top = bottom = np.zeros(generations.size)
    for part, color in PART_COLORS.items():
        values = np.nan_to_num(means[part].values)  # An undefined part has no area.
        next_top, next_bottom = top + values.clip(min=0), bottom + values.clip(max=0)
        for start, end, label in ((top, next_top, part), (bottom, next_bottom, None)):
            axes.fill_between(generations, start, end, step="mid", color=color, lw=0, label=label)
        top, bottom = next_top, next_bottom
    axes.plot(generations, means["change"], color=BLACK, lw=1.2, label="observed change")


@styled
def draw_response(
    changes: Mapping[str, TraitChanges], innate: Mapping[str, xr.Dataset], names: Sequence[str]
) -> Figure:
    """Draw the predicted and the observed response, and the heritability."""
    figure, grid = make_blocks([read_factors(innate[name]).title for name in names], 2, 2.0)
    for (top, bottom), name in zip(grid, names, strict=True):
        values = changes[name].values
        medians = {name: interval_of_median(values[name]) for name in GENETICS}
        draw_curve(top, medians["response"], OBSERVED, "observed response")
        draw_curve(top, medians["predicted response"], PREDICTED, "predicted response")
        draw_curve(bottom, medians["heritability"], OBSERVED)
        label_generations(bottom)
    label_blocks(grid, "response of the\nmean trait", "heritability")
    draw_legend_of_panels(figure, grid[:, 0], 2)
    return figure


def _tabulate_generations(
    changes: Mapping[str, TraitChanges], names: Sequence[str], quantities: Sequence[str]
) -> list[dict[str, Any]]:
    """Return the data of a figure: means and medians over runs by generation."""
    rows = []
    for name in names:
        for quantity in quantities:
            values = changes[name].values[quantity]
            table = tabulate_interval(interval_of_median(values), mean=values.mean("run"))
            rows += [{"condition": name, "quantity": quantity, **row} for row in table]
    return rows
