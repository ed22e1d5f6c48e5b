"""The report section on the Baldwin effect: verdicts, criteria, figures and numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

import xarray as xr
from matplotlib.figure import Figure

from baldwinlab.analysis.assays import figures, headlines, overview, sentences
from baldwinlab.analysis.assays.analysis import Analysis, Number, evaluate_assays
from baldwinlab.analysis.assays.criteria import Criterion, load_rules
from baldwinlab.analysis.assays.phrases import adapt_terms, has_foragers
from baldwinlab.analysis.assays.records import write_analysis
from baldwinlab.analysis.assays.values import Assays
from baldwinlab.analysis.report.embedding import ReportFigure, save_and_inline
from baldwinlab.analysis.report.phrases import format_number
from baldwinlab.analysis.report.sections import Section, render
from baldwinlab.analysis.statistics.curve_intervals import interval_of_median
from baldwinlab.papers.texts import Inference

TITLE: Final = "Is there a Baldwin effect?"
PHASES: Final = {
    1: "Phase 1: learning guides evolution",
    2: "Phase 2: learned behavior becomes innate",
    None: "Mechanism",
}
MEASURES: Final = {
    "off": "fitness, learning off (innate fitness)",
    "on": "fitness, learning on",
    "frozen": "fitness, weights at death, learning off",
    "drift": "fitness, random changes instead of learning (drift)",
    "on, with drift control": "fitness, learning on, generations with the drift control",
    "gain": "gain from learning (on - off)",
    "innate share": "innate share (off / on)",
    "frozen share": "share of the weights at death (frozen / on)",
    "off, neutral assay": "innate fitness, assay neutral",
    "on, neutral assay": "fitness, learning on, assay neutral",
    "gain, neutral assay": "gain from learning, assay neutral",
    "distance": "distance between weights at birth and at death",
    "modules": "fitness with these modules",
    "setting": "fitness in this setting",
    "setting, relative": "fitness relative to the setting of evolution",
    "first meal": "steps to the first meal",
    "ever ate": "share of agents that ate",
    "eaten in life": "items eaten in a lifetime",
    "eaten in the first part of life": "items eaten in the first part of a lifetime",
    "eaten in the last part of life": "items eaten in the last part of a lifetime",
    "common ancestor age": "generations since the last common ancestor",
    "effective ancestors": "effective ancestors",
}
BANDS: Final = (
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
    # Whether the figure has panels for each condition. An overview of many conditions omits it.
    is_per_condition: bool = False


FIGURES: Final = (
    AssayFigure(
        "innate",
        "lives",
        "Innate and learned fitness",
        "Newborns of each generation, simulated again. Top: fitness of the average agent with "
        "learning on, with learning off (innate fitness), with the weights at death and learning "
        "off, and with random changes instead of learning (drift). Bottom: the same as a share of "
        "the fitness with learning on. Genetic assimilation raises the innate share toward 1. "
        f"{BANDS}",
        figures.draw_innate_and_learned,
        ("on", "off", "frozen", "drift"),
        is_per_condition=True,
    ),
    AssayFigure(
        "innate",
        "learning",
        "Gain from learning and weight changes",
        "Top: gain from learning of the average agent. Bottom, if the model has weights: Euclidean "
        "distance between the weights at birth and at death, by layer. Both fall if learned "
        f"behavior becomes innate. {BANDS}",
        figures.draw_gain_and_distance,
        ("gain", "distance"),
        is_per_condition=True,
    ),
    AssayFigure(
        "within-life",
        "within-life",
        "Behavior within a lifetime",
        "Newborns of several generations, and random genomes that also learn. Top: items that an "
        "agent eats in 100 steps, by step of its lifetime. Bottom: share of the agents of all runs "
        f"that have had their first meal. {BANDS}",
        figures.draw_within_life,
        ("eaten in life", "first meal"),
        is_per_condition=True,
    ),
    AssayFigure(
        "modules",
        "modules",
        "Fitness with evolved and random modules",
        "Agents of the last generation with both evolved modules, with one of them replaced by a "
        "random module, and with two random modules. Each point is a run, and the line is the "
        "median.",
        figures.draw_modules,
        ("modules",),
        is_per_condition=True,
    ),
    AssayFigure(
        "reaction",
        "reaction-norms",
        "Reaction norms",
        "Fitness of the last generation in changed settings, one setting at a time. The setting of "
        f"evolution is in parentheses. {BANDS}",
        figures.draw_reaction_norms,
        ("setting",),
    ),
    AssayFigure(
        "descent",
        "descent",
        "Common descent",
        "Left: generations since the last common ancestor of all agents. Right: effective number "
        "of founders in the gene pool (1 / sum of squared shares). "
        f"{BANDS}",
        figures.draw_descent,
        ("common ancestor age", "effective ancestors"),
    ),
)


def section(
    assays: Assays,
    directory: Path,
    last: int = 10,
    inference: Inference | None = None,
    analysis: Analysis | None = None,
) -> Section:
    """Make the section of a report on the stored assays.

    Writes `baldwin.json`, `baldwin.csv` and the figures.

    Parameters
    ----------
    assays : mapping of str to mapping of str to xr.Dataset
        Stored assays by assay and condition.
    directory : Path
        Directory of the study.
    last : int
        Number of generations in the first and the last window.
    inference : Inference or None
        The comparison from which the paper infers the Baldwin effect.
    analysis : Analysis or None
        The analysis of `assays`, if it is already computed.

    Returns
    -------
    Section
        The section.

    Raises
    ------
    ValueError
        An assay is not valid.
    OSError
        A file cannot be written.
    """
    analysis = analysis or evaluate_assays(assays, last)
    write_analysis(analysis, directory)
    is_foraging = has_foragers(assays)
    is_large = overview.is_large(analysis)
    order = list(dict.fromkeys(name for stored in assays.values() for name in stored))
    drawn_overview = overview.draw_overview(analysis, order) if is_large else None
    drawn = draw_assay_figures(assays, analysis, is_foraging)
    has_paper = bool(analysis.results) and inference is not None and is_foraging
    body = render(
        "assays/section.html",
        analysis=analysis,
        last=last,
        phases=PHASES,
        rules=load_rules(),
        headlines=_compose_headlines(analysis),
        many=is_large,
        criteria=_shown_criteria(analysis),
        groups=overview.conditions_by_verdict(analysis) if is_large else {},
        overview=save_and_inline(drawn_overview, directory / "figures") if drawn_overview else None,
        findings={
            result.condition: sentences.compose_sentences(analysis, result)
            for result in analysis.results
        },
        paper=headlines.compare_with_paper(analysis, inference) if has_paper and inference else "",
        figures=[save_and_inline(figure, directory / "figures") for figure in drawn],
        table=tabulate_numbers(analysis),
        conditions=list(dict.fromkeys(number.condition for number in analysis.numbers)),
    )
    short = _summarize(analysis)
    return Section(
        "baldwin", TITLE, adapt_terms(body, is_foraging), adapt_terms(short, is_foraging)
    )


def _compose_headlines(analysis: Analysis) -> dict[str, tuple[str, str]]:
    """Return a description of each condition and its headline."""
    return {
        result.condition: (headlines.describe_condition(result), headlines.compose_headline(result))
        for result in analysis.results
    }


def _shown_criteria(analysis: Analysis) -> list[Criterion]:
    """Return the criteria of the table. An overview omits those that were not measured."""
    if not overview.is_large(analysis):
        return analysis.applicable_criteria
    return [
        criterion
        for criterion in analysis.applicable_criteria
        if any(result.answer(criterion.id).numbers for result in analysis.results)
    ]


def _summarize(analysis: Analysis) -> str:
    """Return the summary of the section."""
    if overview.is_large(analysis):
        n_conditions = len(analysis.results)
        texts = [
            f"In {len(names)} of {n_conditions} conditions: {phases}."
            for phases, names in overview.conditions_by_verdict(analysis).items()
        ]
    else:
        headlines = _compose_headlines(analysis).values()
        texts = [f"On {condition}: {headline}" for condition, headline in headlines]
    return " ".join(filter(None, [*texts, analysis.too_few]))


def tabulate_numbers(analysis: Analysis) -> list[dict[str, Any]]:
    """Return all numbers, with one row per quantity.

    Parameters
    ----------
    analysis : Analysis
        The analysis.

    Returns
    -------
    list of dict
        Rows with the measure, the time or the agents, and the numbers by condition.
    """
    rows: dict[tuple[str, str], dict[str, Number]] = {}
    for number in analysis.numbers:
        rows.setdefault((number.measure, number.when), {})[number.condition] = number
    order = list(dict.fromkeys(measure for measure, _ in rows))
    rows = dict(sorted(rows.items(), key=lambda row: order.index(row[0][0])))
    return [
        {"measure": MEASURES.get(measure, measure), "when": when, "numbers": numbers}
        for (measure, when), numbers in rows.items()
    ]


def draw_assay_figures(
    assays: Assays, analysis: Analysis, is_foraging: bool
) -> Iterator[ReportFigure]:
    """Draw the figures of the stored assays, in the order of the report.

    Parameters
    ----------
    assays : mapping of str to mapping of str to xr.Dataset
        Stored assays by assay and condition.
    analysis : Analysis
        Their analysis.
    is_foraging : bool
        Whether a condition is of the MiniWorld model. Its unit of fitness is energy.

    Yields
    ------
    ReportFigure
        The figures.
    """
    unit = "fitness (energy)" if is_foraging else "fitness"
    is_large = overview.is_large(analysis)
    for figure in FIGURES:
        stored = assays.get(figure.assay, {})
        names = [result.condition for result in analysis.results if result.condition in stored]
        if names and not (is_large and figure.is_per_condition):
            yield _draw(figure, assays, analysis, names, unit)


def _draw(
    figure: AssayFigure, assays: Assays, analysis: Analysis, names: Sequence[str], unit: str
) -> ReportFigure:
    medians = "; ".join(
        f"{name}: {_list_medians(analysis, name, figure.measures)}" for name in names
    )
    return ReportFigure(
        f"baldwin-{figure.name}",
        figure.title,
        figure.caption,
        f"{figure.title}. Medians over runs: {medians}.",
        figure.draw(assays, names, unit),
        _tabulate_medians(assays[figure.assay]),
        (f"baldwinlab assay . --assays {figure.assay}",),
    )


def _tabulate_medians(datasets: Mapping[str, xr.Dataset]) -> list[dict[str, Any]]:
    """Return the data of a figure: medians over runs with their intervals, by condition."""
    rows = []
    for condition, data in datasets.items():
        for name, values in data.data_vars.items():
            means = values.mean("agent") if "agent" in values.dims else values
            numbers = dict(zip(("median", "low", "high"), interval_of_median(means), strict=True))
            table = xr.Dataset(numbers).to_dataframe().reset_index().to_dict("records")
            rows += [{"condition": condition, "quantity": name, **row} for row in table]
    return rows


def _list_medians(analysis: Analysis, condition: str, measures: Sequence[str]) -> str:
    texts = [
        f"{MEASURES[number.measure]}, {number.when}, {format_number(number.median)}"
        for number in analysis.numbers
        if number.condition == condition and number.measure in measures
    ]
    return ", ".join(texts)
