"""Figures of a report: drawn, saved as files, and embedded in the page with a caption."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Final

import numpy as np

from baldwinlab.analysis import figures
from baldwinlab.analysis.report import content
from baldwinlab.analysis.report.agent_figures import (
    draw_emergence,
    draw_maps,
    draw_networks,
    draw_senses,
)
from baldwinlab.analysis.report.content import select_foragers
from baldwinlab.analysis.report.data import ReportData
from baldwinlab.analysis.report.embedding import ReportFigure
from baldwinlab.analysis.report.figure_data import (
    describe_final_medians,
    name_fitness,
    tabulate_evaluations,
    tabulate_generations,
    tabulate_runs,
    tabulate_shares,
)
from baldwinlab.analysis.report.replays import link_conditions, list_replay_commands
from baldwinlab.analysis.statistics.numbers import format_number
from baldwinlab.papers.texts import DEFAULT_FIGURES, Figure

# Figures that are also drawn for models other than MiniWorld.
FIGURES_OF_ANY_MODEL: Final = ("shares", "species", "clocks", "measures", "survival")
# Figures in the section "What was run".
SETUP_FIGURES: Final = ("networks", "senses", "maps")
BOXES_NOTE: Final = (
    "Each point is a run. The box shows the quartiles, and its thick line the median. Whiskers "
    "extend to the most distant run within 1.5 times the interquartile range."
)


def draw_figures(report: ReportData) -> Iterator[ReportFigure]:
    """Draw the figures of a report."""
    names = report.paper.metadata.figures if report.paper else DEFAULT_FIGURES
    captions = report.paper.texts.captions if report.paper else {}
    is_foraging = bool(select_foragers(report.experiments))
    condition_links = link_conditions(report.lives)
    for name in names:
        drawn = DRAW_FUNCTIONS[name](report)
        if drawn:
            # Captions of the paper on maps and agents describe MiniWorld.
            is_caption_valid = is_foraging or name in FIGURES_OF_ANY_MODEL
            addition = captions.get(name, "") if is_caption_valid else ""
            links = drawn.links if drawn.links or name in SETUP_FIGURES else condition_links
            yield drawn._replace(caption=f"{drawn.caption} {addition}".rstrip(), links=links)


def _draw_fitness(report: ReportData) -> ReportFigure:
    data = report.data
    return ReportFigure(
        name="fitness",
        title="Fitness over generations",
        caption=(
            f"{name_fitness(data, 'best', 'average')} of each generation. Lines are means over "
            "runs. Bands are 95 % intervals of the mean (Student's t)."
        ),
        alternative=(
            "Curves of fitness by generation for each condition. "
            f"{describe_final_medians(data, report.last)}"
        ),
        figure=figures.draw_fitness_curves(data),
        table=[row for measure in ("best", "mean") for row in tabulate_generations(data, measure)],
        commands=list_replay_commands(report.lives) if "food_eaten" in data else (),
    )


def _draw_final_fitness(report: ReportData) -> ReportFigure:
    p_values = figures.describe_p_values(report.data, report.results)
    return ReportFigure(
        name="final-fitness",
        title=f"Fitness in the last {report.last} generations",
        caption=(
            f"{name_fitness(report.data, 'best', 'average')}, averaged over the last "
            f"{report.last} generations of each run. "
            f"{' '.join(filter(None, [BOXES_NOTE, p_values]))}"
        ),
        alternative=(
            "Box plots of final fitness by condition. "
            f"{describe_final_medians(report.data, report.last)}"
        ),
        figure=figures.draw_fitness_boxes(report.data, report.results, report.last),
        table=tabulate_runs(report.data, report.last),
    )


def _draw_shares(report: ReportData) -> ReportFigure | None:
    shares = content.compute_shares(report.data, report.experiments)
    if not shares:
        return None
    meanings = "; ".join(f"{name}: {share.attrs['long_name']}" for name, share in shares.items())
    return ReportFigure(
        name="shares",
        title="Composition of the generations",
        caption=(
            "Lines are means over agents and runs. Bands are 95 % intervals of the mean over runs "
            f"(Student's t). {meanings}."
        ),
        alternative=f"Curves by generation for each condition: {meanings}.",
        figure=figures.draw_shares(shares),
        table=tabulate_shares(shares),
    )


def _draw_species(report: ReportData) -> ReportFigure | None:
    shares = content.compute_species_composition(report.data, report.experiments)
    if not shares:
        return None
    names = ", ".join(map(str, shares))
    return ReportFigure(
        name="species",
        title="Shares of the species",
        caption=(
            "Share of each species in the agents of a generation, in the conditions in which the "
            "species compete. Lines are means over runs. Bands are 95 % intervals of the mean "
            "(Student's t). A run that stopped keeps its last value."
        ),
        alternative=f"Curves by generation for each condition: shares of {names}.",
        figure=figures.draw_shares(shares),
        table=[row for row in tabulate_shares(shares) if not math.isnan(row["mean"])],
    )


def _draw_measures(report: ReportData) -> ReportFigure | None:
    if not report.model_measures:
        return None
    measures = [figures.MeasureValues(*measure) for measure in report.model_measures]
    medians = []
    rows = []
    for measure in report.model_measures:
        values = {name: sample for name, sample in measure.values.items() if sample.size}
        texts = [
            f"{name} {format_number(float(np.median(sample)))}" for name, sample in values.items()
        ]
        medians.append(f"{measure.meaning}: {', '.join(texts)}")
        for name, sample in values.items():
            row = {"condition": name, "measure": measure.name}
            rows += [row | {"value": value} for value in sample.tolist()]
    return ReportFigure(
        name="measures",
        title="Measures that the claims compare",
        caption=BOXES_NOTE,
        alternative=f"Box plots by condition, with medians over runs: {'; '.join(medians)}.",
        figure=figures.draw_measures(report.data, measures),
        table=rows,
    )


def _draw_fitness_by_evaluations(report: ReportData) -> ReportFigure | None:
    evaluation_variable = content.find_evaluation_variable(report.experiments)
    if not evaluation_variable:
        return None
    return ReportFigure(
        name="clocks",
        title="Fitness by generations and by evaluations",
        caption=(
            f"{name_fitness(report.data, 'average')}, mean over runs. The horizontal axis is the "
            "generation, or the total number of evaluations by all agents of a run. Learning uses "
            "many evaluations within one generation."
        ),
        alternative=(
            "The same curves of fitness by generation and by evaluations. "
            f"{describe_final_medians(report.data, 1)}"
        ),
        figure=figures.draw_fitness_by_evaluations(report.data, evaluation_variable),
        table=tabulate_evaluations(report.data, evaluation_variable),
    )


def _draw_survival(report: ReportData) -> ReportFigure:
    return ReportFigure(
        name="survival",
        title="Survival of the populations",
        caption=(
            "Share of runs that survive, by time (Kaplan-Meier). A curve that ends above 0 has "
            "runs that still survive at the end of the study."
        ),
        alternative=(
            f"Curves of survival for each condition. {describe_final_medians(report.data, 1)}"
        ),
        figure=figures.draw_survival(report.data),
        table=tabulate_runs(report.data, 1),
    )


DRAW_FUNCTIONS: Final[Mapping[Figure, Callable[[ReportData], ReportFigure | None]]] = {
    "fitness": _draw_fitness,
    "final-fitness": _draw_final_fitness,
    "emergence": draw_emergence,
    "networks": draw_networks,
    "maps": draw_maps,
    "senses": draw_senses,
    "shares": _draw_shares,
    "species": _draw_species,
    "clocks": _draw_fitness_by_evaluations,
    "measures": _draw_measures,
    "survival": _draw_survival,
}
