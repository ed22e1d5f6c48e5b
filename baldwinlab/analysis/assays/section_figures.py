"""Figures in the section of a report on assays."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import xarray as xr

from baldwinlab.analysis.assays.analysis import Analysis
from baldwinlab.analysis.assays.evaluation import load_evaluations, name_measure
from baldwinlab.analysis.assays.phrases import fill_terms
from baldwinlab.analysis.assays.values import Assays, parse_experiments
from baldwinlab.analysis.report.embedding import ReportFigure
from baldwinlab.analysis.statistics.curve_intervals import interval_of_median
from baldwinlab.analysis.statistics.numbers import format_number
from baldwinlab.experiment.outcome import name_food_outcome


def draw_assay_figures(assays: Assays, analysis: Analysis) -> Iterator[ReportFigure]:
    """Draw the figures of the stored assays, in the order of the report."""
    unit = name_food_outcome(list(parse_experiments(assays).values()))
    for assay, evaluation in load_evaluations().items():
        stored = assays.get(assay, {})
        names = [result.condition for result in analysis.results if result.condition in stored]
        for figure in evaluation.figures if names else ():
            medians = "; ".join(
                f"{name}: {_list_medians(analysis, name, figure.measures)}" for name in names
            )
            yield ReportFigure(
                name=f"baldwin-{figure.name}",
                title=figure.title,
                caption=fill_terms(figure.caption, analysis.terms),
                alternative=f"{figure.title}. Medians over runs: {medians}.",
                figure=figure.draw(assays, names, unit),
                table=_tabulate_medians(stored),
                commands=(f"baldwinlab assay . --assays {assay}",),
            )


def _tabulate_medians(datasets: Mapping[str, xr.Dataset]) -> list[dict[str, Any]]:
    """Return the data of a figure: medians over runs with their intervals, by condition."""
    rows = []
    for condition, data in datasets.items():
        for name, values in data.data_vars.items():
            means = values.mean("agent") if "agent" in values.dims else values
            interval = interval_of_median(means)
            numbers = {"median": interval.center, "low": interval.low, "high": interval.high}
            table = xr.Dataset(numbers).to_dataframe().reset_index().to_dict("records")
            rows += [{"condition": condition, "quantity": name, **row} for row in table]
    return rows


def _list_medians(analysis: Analysis, condition: str, measures: Sequence[str]) -> str:
    numbers = [number for number in analysis.numbers if number.condition == condition]
    texts = [
        f"{name_measure(number.measure, analysis.terms)}, {number.when}, "
        f"{format_number(number.median)}"
        for number in numbers
        if number.measure in measures
    ]
    return ", ".join(texts)
