"""Figures in the section of a report on assays."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Final, NamedTuple

import xarray as xr
from matplotlib.figure import Figure

from baldwinlab.analysis.assays import figures
from baldwinlab.analysis.assays.analysis import Analysis
from baldwinlab.analysis.assays.phrases import Terms, fill_terms
from baldwinlab.analysis.assays.reaction_norms import PARAMETERS, QUANTITY_PREFIX
from baldwinlab.analysis.assays.values import Assays, parse_experiments
from baldwinlab.analysis.report.embedding import ReportFigure
from baldwinlab.analysis.statistics.curve_intervals import interval_of_median, tabulate_interval
from baldwinlab.analysis.statistics.numbers import format_number
from baldwinlab.experiment.outcome import name_food_outcome

MEASURE_NAMES: Final = {
    "off": "fitness, learning off (innate fitness)",
    "on": "fitness, learning on",
    "frozen": "fitness, {weights} at death, learning off",
    "drift": "fitness, random changes instead of learning (drift)",
    "on, with drift control": "fitness, learning on, generations with the drift control",
    "gain": "gain from learning (on - off)",
    "innate share": "innate share (off / on)",
    "frozen share": "share of the {weights} at death (frozen / on)",
    "off, neutral assay": "innate fitness, assay neutral",
    "on, neutral assay": "fitness, learning on, assay neutral",
    "gain, neutral assay": "gain from learning, assay neutral",
    "distance": "distance between {weights} at birth and at death",
    "modules": "fitness with these modules",
    "setting": "fitness in this setting",
    "setting, relative": "fitness relative to the setting of evolution",
    "first meal": "steps to the first meal",
    "ever ate": "share of agents that eat",
    "eaten in life": "items eaten in a lifetime",
    "eaten in the first part of life": "items eaten in the first part of a lifetime",
    "eaten in the last part of life": "items eaten in the last part of a lifetime",
    "common ancestor age": "generations since the last common ancestor",
    "effective ancestors": "effective ancestors",
}

BANDS_NOTE: Final = (
    "Lines are medians over runs. Bands are their 95 % intervals (sign test), shown for six runs "
    "or more."
)


class AssayFigure(NamedTuple):
    """A figure of an assay."""

    assay: str
    name: str
    title: str
    caption: str
    draw: Callable[[Assays, Sequence[str], str], Figure]
    # Quantities in the alternative text.
    measures: Sequence[str]


ASSAY_FIGURES: Final = (
    AssayFigure(
        assay="innate",
        name="lives",
        title="Innate and learned fitness",
        caption=(
            "Newborns of each generation, simulated again. Top: fitness of the average agent with "
            "learning on, with learning off (innate fitness), with the {weights} at death and "
            "learning off, and with random changes instead of learning (drift). Bottom: the same "
            "as a share of the fitness with learning on. Genetic assimilation raises the innate "
            f"share toward 1. {BANDS_NOTE}"
        ),
        draw=figures.draw_innate_and_learned,
        measures=("on", "off", "frozen", "drift"),
    ),
    AssayFigure(
        assay="innate",
        name="learning",
        title="Gain from learning and weight changes",
        caption=(
            "Top: gain from learning of the average agent. Bottom, if the model has {weights}: "
            "Euclidean distance between the {weights} at birth and at death, by layer. "
            f"{BANDS_NOTE}"
        ),
        draw=figures.draw_gain_and_distance,
        measures=("gain", "distance"),
    ),
    AssayFigure(
        assay="within-life",
        name="within-life",
        title="Behavior within a lifetime",
        caption=(
            "Newborns of several generations, and random genomes that also learn. Top: items that "
            "an agent eats in 100 steps, by step of its lifetime. Bottom: share of the agents of "
            f"all runs that have had their first meal. {BANDS_NOTE}"
        ),
        draw=figures.draw_within_life,
        measures=("eaten in life", "first meal"),
    ),
    AssayFigure(
        assay="modules",
        name="modules",
        title="Fitness with evolved and random modules",
        caption=(
            "Agents of the last generation with both evolved modules, with one of them replaced by "
            "a random module, and with two random modules. Each point is a run, and the line is "
            "the median."
        ),
        draw=figures.draw_modules,
        measures=("modules",),
    ),
    AssayFigure(
        assay="reaction",
        name="reaction-norms",
        title="Reaction norms",
        caption=(
            "Fitness of the last generation in changed settings, one setting at a time. The "
            f"setting of evolution is in parentheses. {BANDS_NOTE}"
        ),
        draw=figures.draw_reaction_norms,
        measures=("setting",),
    ),
    AssayFigure(
        assay="reaction-norms",
        name="learning-norms",
        title="Reaction norms over learning",
        caption=(
            "Fitness of the average agent of four generations, by the multiple of the learning "
            "rate, or of the setting that the model declares. 0 is learning off, and 1 is the "
            "setting of the study. Genetic assimilation raises the fitness at 0 and makes the "
            f"line flat. {BANDS_NOTE}"
        ),
        draw=figures.draw_norms,
        measures=tuple(f"{QUANTITY_PREFIX}{name}" for name in PARAMETERS),
    ),
    AssayFigure(
        assay="descent",
        name="descent",
        title="Common descent",
        caption=(
            "Left: generations since the last common ancestor of all agents. Right: effective "
            f"number of founders in the gene pool (1 / sum of squared shares). {BANDS_NOTE}"
        ),
        draw=figures.draw_descent,
        measures=("common ancestor age", "effective ancestors"),
    ),
)


def draw_assay_figures(assays: Assays, analysis: Analysis) -> Iterator[ReportFigure]:
    """Draw the figures of the stored assays, in the order of the report."""
    unit = name_food_outcome(list(parse_experiments(assays).values()))
    for figure in ASSAY_FIGURES:
        stored = assays.get(figure.assay, {})
        names = [result.condition for result in analysis.results if result.condition in stored]
        if names:
            yield _draw(figure, assays, analysis, names, unit)


def _draw(
    figure: AssayFigure, assays: Assays, analysis: Analysis, names: Sequence[str], unit: str
) -> ReportFigure:
    medians = "; ".join(
        f"{name}: {_list_medians(analysis, name, figure.measures)}" for name in names
    )
    return ReportFigure(
        name=f"baldwin-{figure.name}",
        title=figure.title,
        caption=fill_terms(figure.caption, analysis.terms),
        alternative=f"{figure.title}. Medians over runs: {medians}.",
        figure=figure.draw(assays, names, unit),
        table=_tabulate_medians(assays[figure.assay]),
        commands=(f"baldwinlab assay . --assays {figure.assay}",),
    )


def _tabulate_medians(datasets: Mapping[str, xr.Dataset]) -> list[dict[str, Any]]:
    """Return the data of a figure: medians over runs with their intervals, by condition."""
    rows = []
    for condition, data in datasets.items():
        for name, values in data.data_vars.items():
            means = values.mean("agent") if "agent" in values.dims else values
            table = tabulate_interval(interval_of_median(means))
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


def name_measure(measure: str, terms: Terms) -> str:
    """Return the name of a measure in figures and tables."""
    name = MEASURE_NAMES.get(measure)
    return fill_terms(name, terms) if name else measure
