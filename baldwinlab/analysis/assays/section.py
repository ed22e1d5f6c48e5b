"""The section "Is it the Baldwin effect?": verdict, questions, figures and numbers, of the assays that are stored."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import xarray as xr
from matplotlib.figure import Figure

from baldwinlab.analysis.assays import figures, sentences
from baldwinlab.analysis.assays import overview as glance
from baldwinlab.analysis.assays.analysis import Analysis, Number, evaluate, rules, write
from baldwinlab.analysis.assays.phrases import fitting, of_foragers
from baldwinlab.analysis.assays.values import Assays
from baldwinlab.analysis.report.figures import Picture, embed
from baldwinlab.analysis.report.phrases import number
from baldwinlab.analysis.report.sections import Section, render
from baldwinlab.analysis.statistics.fitness import interval_of_median
from baldwinlab.papers.texts import Inference

TITLE = "Is it the Baldwin effect?"
PHASES = {
    1: "Phase one: learning guides selection",
    2: "Phase two: what was learned becomes innate",
    None: "How it comes about",
}

MEASURES = {
    "off": "fitness, learning off (innate)",
    "on": "fitness, learning on",
    "frozen": "fitness, weights at death and learning off",
    "drift": "fitness, random change in place of learning",
    "on, where drift was lived": "fitness, learning on, in the generations in which drift was lived",
    "gain": "gain from learning (on - off)",
    "innate share": "innate share (off / on)",
    "kept share": "weights at death, share (frozen / on)",
    "off, beside the neutral twin": "fitness, learning off (innate), beside the neutral twin",
    "on, beside the neutral twin": "fitness, learning on, beside the neutral twin",
    "gain, beside the neutral twin": "gain from learning, beside the neutral twin",
    "distance": "distance that learning moves the weights",
    "modules": "fitness with these modules",
    "setting": "fitness in this setting",
    "setting, relative": "the same, relative to as evolved",
    "first meal": "steps to the first meal",
    "ever ate": "share of agents that ever ate",
    "eaten in life": "items eaten in life",
    "eaten in the first part of life": "items eaten in the first part of life",
    "eaten in the last part of life": "items eaten in the last part of life",
    "common ancestor age": "generations since the last common ancestor",
    "effective ancestors": "effective ancestors",
}


def section(
    assays: Assays,
    directory: Path,
    last: int = 10,
    inference: Inference | None = None,
    analysis: Analysis | None = None,
) -> Section:
    """The section of a report on these assays, beside how a paper infers the effect if it does.

    Writes baldwin.json, baldwin.csv and the figures to `directory`.

    Raises ValueError for an assay that is not what it should be, and OSError.
    """
    analysis = analysis or evaluate(assays, last)
    write(analysis, directory)
    headlines = {
        subject.condition: (sentences.where(subject), sentences.headline(subject))
        for subject in analysis.subjects
    }
    many, order = (
        glance.of_many(analysis),
        list(dict.fromkeys(name for stored in assays.values() for name in stored)),
    )
    groups = glance.by_phases(analysis) if many else {}
    overview = glance.picture(analysis, order) if many else None
    body = render(
        "assays/section.html",
        analysis=analysis,
        last=last,
        phases=PHASES,
        rules=rules(),
        headlines=headlines,
        many=many,
        asked=[
            one
            for one in analysis.asked
            if not many or any(each.answer(one.id).numbers for each in analysis.subjects)
        ],
        groups=groups,
        overview=embed(overview, directory / "figures") if overview else None,
        findings={
            subject.condition: sentences.sentences(analysis, subject)
            for subject in analysis.subjects
        },
        paper=sentences.beside_the_paper(analysis, inference)
        if analysis.subjects and inference and of_foragers(assays)
        else "",
        figures=[embed(picture, directory / "figures") for picture in pictures(assays, analysis)],
        table=numbers_table(analysis),
        conditions=list(dict.fromkeys(found.condition for found in analysis.numbers)),
    )
    in_full = [f"On {where}: {headline}" for where, headline in headlines.values()]
    grouped = [
        f"In {len(names)} of {len(headlines)} conditions: {said}." for said, names in groups.items()
    ]
    short = " ".join([*(grouped if many else in_full), *filter(None, [analysis.too_few])])
    return Section("baldwin", TITLE, fitting(body, assays), fitting(short, assays))


def numbers_table(analysis: Analysis) -> list[dict[str, Any]]:
    """A row for each quantity, those of a measure together, with a number for each condition that has it."""
    rows: dict[tuple[str, str], dict[str, Number]] = {}
    for found in analysis.numbers:
        rows.setdefault((found.measure, found.when), {})[found.condition] = found
    measures = list(dict.fromkeys(measure for measure, _ in rows))
    rows = dict(sorted(rows.items(), key=lambda row: measures.index(row[0][0])))
    return [
        {"measure": MEASURES.get(measure, measure), "when": when, "numbers": numbers}
        for (measure, when), numbers in rows.items()
    ]


def pictures(assays: Assays, analysis: Analysis) -> Iterator[Picture]:
    """In the order in which the report shows them, of the assays that are stored."""
    many = glance.of_many(analysis)
    for assay, name, title, caption, figure, shown in _PICTURES:
        subjects = [
            subject.condition
            for subject in analysis.subjects
            if subject.condition in assays.get(assay, {})
        ]
        if subjects and not (many and assay in A_COLUMN_EACH):
            medians = "; ".join(
                f"{condition}: {_medians(analysis, condition, shown)}" for condition in subjects
            )
            text, drawn = f"{title}. Medians over runs: {medians}.", assays[assay]
            yield Picture(
                f"baldwin-{name}",
                title,
                caption,
                text,
                figure(assays, subjects),
                _over_runs(drawn),
                _measured(assay),
            )


def _over_runs(drawn: Mapping[str, xr.Dataset]) -> list[dict[str, Any]]:
    """What a figure is drawn from: of each condition and quantity, at each place of an axis, the median over runs."""
    rows = []
    for condition, data in drawn.items():
        for name, values in data.data_vars.items():
            means = values.mean("agent") if "agent" in values.dims else values
            numbers = dict(zip(("median", "low", "high"), interval_of_median(means), strict=True))
            table = xr.Dataset(numbers).to_dataframe().reset_index().to_dict("records")
            rows += [{"condition": condition, "quantity": name, **row} for row in table]
    return rows


def _measured(assay: str) -> tuple[str, ...]:
    return (f"baldwinlab assay . --assays {assay}",)


def _medians(analysis: Analysis, condition: str, measures: Sequence[str]) -> str:
    found = [
        one for one in analysis.numbers if one.condition == condition and one.measure in measures
    ]
    return ", ".join(f"{MEASURES[one.measure]}, {one.when}, {number(one.median)}" for one in found)


A_COLUMN_EACH = (
    "innate",
    "within-life",
    "modules",
)  # assays whose figures have one for each condition
BANDS = "Lines are medians over runs, bands their 95 % intervals, by the sign test, of six runs or more."

_PICTURES: Sequence[tuple[str, str, str, str, Callable[[Assays, Sequence[str]], Figure], Sequence[str]]] = (
    (
        "innate", "lives", "Innate and learned",
        "Newborns of each generation, lived again. Above: fitness of the average agent with learning on, with learning off (what "
        "is innate), with the weights of its own death and learning off, and with random change in place of learning. Below: the "
        "share of the fitness with learning that is reached without it; assimilation would raise the innate share towards 1. "
        f"{BANDS}",
        figures.innate_and_learned, ("on", "off", "frozen", "drift"),
    ),
    (
        "innate", "learning", "What learning does",
        "Above: what an agent gains from learning. Below, where that is told: how far learning moves the weights of each layer "
        f"in a life (Euclidean distance). Both would fall if what is learned became innate. {BANDS}",
        figures.what_learning_does, ("gain", "distance"),
    ),
    (
        "within-life", "within-life", "Within a life",
        "Newborns of several generations, and random genomes that learn likewise. Above: items that an agent eats in 100 steps, "
        f"by step of its life. {BANDS} Below: the share of all agents of all runs that have had their first meal.",
        figures.within_life, ("eaten in life", "first meal"),
    ),
    (
        "modules", "modules", "Where the knowledge sits",
        "Agents of the last generation with their own modules, with a random one in place of one of them, and with both random. "
        "Each point is a run, the line is the median.",
        figures.modules, ("modules",),
    ),
    (
        "reaction", "reaction-norms", "Reaction norms",
        "Fitness of the last generation under circumstances that it did not evolve in, one changed at a time; in parentheses the "
        f"value that it evolved with. {BANDS}",
        lambda assays, subjects: figures.reaction_norms(assays), ("setting",),
    ),
    (
        "descent", "descent", "Descent",
        "Left: how long ago the last agent lived from whom all agents descend. Right: of how many agents of the first generation "
        f"the gene pool is made, in effect (1 / sum of squared shares). {BANDS}",
        lambda assays, subjects: figures.descent(assays), ("common ancestor age", "effective ancestors"),
    ),
)  # fmt: skip
