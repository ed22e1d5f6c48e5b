"""Fractions by generation, of each allele or of each species: a panel per condition."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import xarray as xr
from matplotlib.figure import Figure

from baldwinlab.analysis.figures.curves import draw_curve, make_panels
from baldwinlab.analysis.figures.line_labels import label_lines
from baldwinlab.analysis.figures.style import (
    choose_style,
    label_generations,
    style_conditions,
    styled,
)
from baldwinlab.analysis.report.content import iterate_loaded_models
from baldwinlab.analysis.report.data import ReportData
from baldwinlab.analysis.report.sections import ReportFigure
from baldwinlab.analysis.statistics.fitness import compute_species_curves
from baldwinlab.analysis.statistics.intervals import interval_of_mean
from baldwinlab.experiment import BaseExperiment
from baldwinlab.experiment.species import ACROSS

# Largest number of panels in a row.
MAX_COLUMNS = 3
# Heights of a panel and of the legend, in inches.
PANEL_HEIGHT = 2.2
LEGEND_HEIGHT = 0.5


def draw_figure(report: ReportData) -> ReportFigure | None:
    shares = compute_shares(report.data, report.experiments)
    if not shares:
        return None
    meanings = "; ".join(f"{name}: {share.attrs['long_name']}" for name, share in shares.items())
    return ReportFigure(
        title="Composition of the generations",
        caption=(
            "Lines are means over agents and runs. Bands are 95 % intervals of the mean over runs "
            f"(Student's t). {meanings}."
        ),
        alternative=f"Curves by generation for each condition: {meanings}.",
        figure=draw_shares(shares),
        table=tabulate_shares(shares),
    )


def draw_species_figure(report: ReportData) -> ReportFigure | None:
    shares = compute_species_composition(report.data, report.experiments)
    if not shares:
        return None
    names = ", ".join(map(str, shares))
    return ReportFigure(
        title="Shares of the species",
        caption=(
            "Share of each species in the agents of a generation, in the conditions in which the "
            "species compete. Lines are means over runs. Bands are 95 % intervals of the mean "
            "(Student's t). A run that stopped keeps its last value."
        ),
        alternative=f"Curves by generation for each condition: shares of {names}.",
        figure=draw_shares(shares),
        table=[row for row in tabulate_shares(shares) if not math.isnan(row["mean"])],
    )


@styled
def draw_shares(shares: xr.Dataset) -> Figure:
    """Draw fractions (condition, run, generation): the mean over runs and its 95 % interval."""
    conditions = style_conditions(shares)
    figure, panels = make_panels(
        len(conditions), MAX_COLUMNS, PANEL_HEIGHT, LEGEND_HEIGHT, sharey=True
    )
    styles = {str(name): choose_style(index) for index, name in enumerate(shares)}
    for axes, condition in zip(panels.flat, conditions, strict=False):
        axes.set_title(condition.name)
        for name, style in styles.items():
            interval = interval_of_mean(shares[name].sel(condition=condition.name))
            draw_curve(axes, interval, style, name)
        axes.set_ylim(-0.025, 1.025)
        label_generations(axes)
    for row in panels:
        row[0].set_ylabel("share")
    label_lines(figure, styles)
    return figure


def compute_shares(data: xr.Dataset, conditions: Mapping[str, BaseExperiment]) -> xr.Dataset:
    """Return the fractions that the models define, such as the fraction of each allele.

    `data`: the runs, with the dimensions (condition, run, generation, agent). Each variable of the
    result has the dimensions (condition, run, generation) and its meaning as `long_name`. The
    result is empty unless the models of all conditions are loaded and define the same fractions.
    """
    shares = [model.all_shares() for model in iterate_loaded_models(conditions)]
    meanings = [{name: share.meaning for name, share in entry.items()} for entry in shares]
    is_model_missing = len(shares) < len(conditions)
    if is_model_missing or any(meaning != meanings[0] for meaning in meanings):
        return xr.Dataset()
    return xr.Dataset(
        {
            name: share.of(data).assign_attrs(long_name=share.meaning, valid_max=1.0)
            for name, share in shares[0].items()
        }
    )


def compute_species_composition(
    data: xr.Dataset, conditions: Mapping[str, BaseExperiment]
) -> xr.Dataset:
    """Return the fraction of each species in each generation, if the species compete.

    `data`: the runs, with the dimensions (condition, run, generation, agent). The result has a
    variable for each species, such as "species prey", with the dimensions (condition, run,
    generation). Conditions without the species have NaN. Empty if no species compete.
    """
    compositions = []
    for name, experiment in conditions.items():
        if experiment.population.species and experiment.evolution.compete == ACROSS:
            species_names = [species.name for species in experiment.population.species]
            curves = compute_species_curves(
                data.sel(condition=[name]), species_names, ["composition"]
            )
            # The prefix is needed, because a species can have the name of a coordinate.
            shares = {
                f"species {species}": share.assign_attrs(
                    long_name=f"share of agents of the species {species}", valid_max=1.0
                )
                for species, share in curves["composition"].items()
            }
            compositions.append(xr.Dataset(shares))
    if not compositions:
        return xr.Dataset()
    # The first condition with a species determines the attributes.
    return xr.concat(compositions, "condition", join="outer", combine_attrs="override")


def tabulate_shares(shares: xr.Dataset) -> list[dict[str, Any]]:
    """Return means over runs: one row per variable (column `share`), condition and generation."""
    generations = shares["generation"].values
    rows = []
    for name, share in shares.items():
        for condition, values in share.mean("run").groupby("condition"):
            # `values` is [condition, generation] with one condition.
            for generation, value in zip(generations, values.values.ravel(), strict=True):
                row = {"condition": str(condition), "share": str(name)}
                rows.append(row | {"generation": int(generation), "mean": float(value)})
    return rows
