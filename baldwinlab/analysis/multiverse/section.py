"""Report section on the variants of a paper: sentences, figures and a table."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from math import nan
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from baldwinlab.analysis.figures.charts import WHITE_TO_BLUE, draw_cells, label_cells
from baldwinlab.analysis.figures.style import FIGURE_WIDTH, styled
from baldwinlab.analysis.multiverse import analysis
from baldwinlab.analysis.multiverse.analysis import compute_shares
from baldwinlab.analysis.multiverse.records import Multiverse, Outcome, VariantResult
from baldwinlab.analysis.multiverse.sentences import (
    VERDICT_PHRASES,
    compose_sentences,
    describe_combinations,
)
from baldwinlab.analysis.palette import DARK_GRAY, MID_GRAY, VERDICT_COLORS
from baldwinlab.analysis.report.content import format_range
from baldwinlab.analysis.report.sections import ReportFigure, Section, render, save_and_inline
from baldwinlab.analysis.report.tables import Table, tabulate
from baldwinlab.analysis.results.numbers import (
    format_estimate,
    format_number,
    format_percentage,
    join_names,
)
from baldwinlab.analysis.results.verdicts import HOLDS, MARKS, NOT_EVALUATED, VERDICTS, Verdict
from baldwinlab.papers import load

# Heights in inches: a row, and headings and margins without and with a legend.
ROW_HEIGHT: Final = 0.27
HEADINGS_HEIGHT: Final = 0.6
HEADINGS_AND_LEGEND_HEIGHT: Final = 0.9


class StandardStudy(NamedTuple):
    """A study under the standard variant. The report of the study has the section."""

    verdicts: Mapping[str, Verdict]  # By claim.
    # Smallest and largest number of runs of a condition.
    runs: tuple[int, int]


def make_section(
    multiverse: Multiverse, folder: Path, study: StandardStudy | None = None
) -> Section:
    """Make the section of a report on the variants of a paper, and save its figures."""
    singles = multiverse.singles
    explanation = explain_differences(multiverse, study) if study else ""
    sentences = compose_sentences(singles)
    paper_effects = analysis.list_paper_effects(multiverse)
    body = render(
        "multiverse/section.html",
        n_variants=len(singles.variants),
        choices=singles.choices,
        n_combinations=len(multiverse.variants),
        runs=format_range(n_runs for variant in multiverse.variants for n_runs in variant.runs),
        sentences=[*filter(None, [explanation]), *sentences],
        combinations=describe_combinations(multiverse),
        figures=[save_and_inline(figure, folder) for figure in _draw_figures(multiverse)],
        claims=multiverse.claims,
        paper_effects=paper_effects,
        distances=_tabulate_distances(singles.variants, paper_effects),
    )
    return Section("variants", "Variants of the paper", body, sentences[0], explanation)


def explain_differences(multiverse: Multiverse, study: StandardStudy) -> str:
    """Explain why the standard variant and the study have different verdicts."""
    standard = analysis.find_standard_variant(multiverse)
    if standard is None or standard.runs == study.runs:
        return ""
    differing: dict[tuple[Verdict, Verdict], list[str]] = {}
    for claim, outcome in standard.outcomes.items():
        in_study = study.verdicts.get(claim, NOT_EVALUATED)
        in_variant = outcome.verdict
        if in_study != in_variant and NOT_EVALUATED not in (in_study, in_variant):
            differing.setdefault((in_study, in_variant), []).append(claim)
    if not differing:
        return ""
    study_runs = format_range(study.runs)
    variant_runs = format_range(standard.runs)
    changes = "; ".join(
        f"{join_names(claims)} ({VERDICT_PHRASES[in_study]} with {study_runs}, "
        f"{VERDICT_PHRASES[in_variant]} with {variant_runs})"
        for (in_study, in_variant), claims in differing.items()
    )
    return (
        f"This study has {study_runs} runs of each condition, and every variant has "
        f"{variant_runs}. Some verdicts therefore differ: {changes}. With fewer runs, only larger "
        "differences are significant. Prefer the verdicts of the study with more runs, and compare "
        "variants only with each other."
    )


def compose_lead(multiverse: Multiverse) -> str:
    """Return the first paragraph of the page of a multiverse."""
    return (
        f"{multiverse.source or load().metadata.source} does not specify all settings. This page "
        "shows which claims depend on these open choices. "
        f"Seed {multiverse.seed}; the value of a run is its average over the last "
        f"{multiverse.last} generations."
    )


def _tabulate_distances(
    variants: Sequence[VariantResult], paper_effects: Mapping[str, float]
) -> Table:
    """Return a row per variant: counts of verdicts, effects, and distance from the paper."""
    rows = []
    for variant in variants:
        verdicts = [outcome.verdict for outcome in variant.outcomes.values()]
        rows.append(
            [
                variant.name,
                variant.description,
                *(verdicts.count(verdict) for verdict in VERDICT_PHRASES),
                *(_format_effect(variant.outcomes[claim]) for claim in paper_effects),
                "–" if variant.distance is None else format_number(variant.distance),
            ]
        )
    effects = [f"{claim}, paper {effect:+g}" for claim, effect in paper_effects.items()]
    numbers = ("Hold", "Undecided", "Do not hold", *effects, "Distance")
    label = "Distance of each variant from the paper"
    return tabulate(label, ("Variant", "Change"), numbers, rows)


def _format_effect(outcome: Outcome) -> str:
    if outcome.effect is None:
        return "–"
    sign = "+" if outcome.effect > 0 else ""
    return f"{sign}{format_estimate(outcome.effect, *(outcome.interval or (nan, nan)))}"


def _draw_figures(multiverse: Multiverse) -> Iterator[ReportFigure]:
    singles = multiverse.singles
    held_claims = "; ".join(
        f"{variant.name}: {_list_held(variant) or 'none'}" for variant in singles.variants
    )
    yield ReportFigure(
        name="variants",
        title="Claims under each variant",
        caption=(
            "Each row is a variant with its changed choice, and each column is a claim. The number "
            "is the effect in the deciding comparison: with a sign, a difference of medians (items "
            "per agent, or a share of agents); without a sign, a level."
        ),
        alternative=f"A table of verdicts. Claims that hold, by variant: {held_claims}.",
        figure=draw_variants(multiverse),
        table=list(_tabulate_outcomes(singles)),
    )
    if multiverse.has_combinations:
        yield ReportFigure(
            name="variants-shares",
            title="Claims under all combinations",
            caption=(
                "Share of the combinations with an alternative under which a claim holds. A claim "
                "depends on a choice if the rows of the choice differ."
            ),
            alternative=" ".join(describe_combinations(multiverse)),
            figure=draw_shares(multiverse),
            table=[share._asdict() for share in analysis.compute_shares(multiverse)],
        )


def _list_held(variant: VariantResult) -> str:
    return join_names(
        [claim for claim, outcome in variant.outcomes.items() if outcome.verdict == HOLDS]
    )


def _tabulate_outcomes(multiverse: Multiverse) -> Iterator[dict[str, Any]]:
    """Yield one row per variant and claim."""
    for variant in multiverse.variants:
        for claim, outcome in variant.outcomes.items():
            low, high = outcome.interval or (None, None)
            yield {
                "variant": variant.name,
                "claim": claim,
                **outcome.model_dump(exclude={"interval"}),
                "low": low,
                "high": high,
            }


@styled
def draw_variants(multiverse: Multiverse) -> Figure:
    """Draw verdict and deciding effect: a row per single-choice variant, a column per claim."""
    variants = multiverse.singles.variants
    claims = [claim.id for claim in multiverse.claims]
    figure = Figure((FIGURE_WIDTH, HEADINGS_AND_LEGEND_HEIGHT + ROW_HEIGHT * len(variants)))
    axes = figure.subplots()
    outcomes = [[variant.outcomes[claim] for claim in claims] for variant in variants]
    # The value of a cell is the index of the verdict in the color map.
    verdicts = list(VERDICT_COLORS)
    draw_cells(
        axes,
        np.array([[verdicts.index(outcome.verdict) for outcome in row] for row in outcomes], float),
        [[_format_outcome(outcome) for outcome in row] for row in outcomes],
        ListedColormap([VERDICT_COLORS[verdict] for verdict in verdicts]),
        (0, len(verdicts) - 1),
    )
    labels = [f"{variant.name}  {''.join(variant.choices)}".rstrip() for variant in variants]
    _label_claims(axes, labels, claims)
    choices = [min(variant.choices, default="") for variant in variants]  # At most one each.
    _draw_cell_borders(axes, len(claims), choices)
    drawn_verdicts = {outcome.verdict for row in outcomes for outcome in row}
    legend_handles = [
        Patch(
            facecolor=VERDICT_COLORS[verdict],
            edgecolor=MID_GRAY,
            label=f"{MARKS[verdict]} {verdict}",
        )
        for verdict in VERDICTS
        if verdict in drawn_verdicts
    ]
    figure.legend(handles=legend_handles, loc="outside lower center", ncols=len(legend_handles))
    return figure


def _format_outcome(outcome: Outcome) -> str:
    """Return a mark and the effect, such as "✓ +282". Only a tested difference has a plus sign."""
    if outcome.effect is None:
        return MARKS[outcome.verdict]
    sign = "+" if outcome.p_holm is not None and outcome.effect > 0 else ""
    return f"{MARKS[outcome.verdict]} {sign}{format_number(outcome.effect)}"


@styled
def draw_shares(multiverse: Multiverse) -> Figure:
    """Draw the shares of combinations that hold: a row per alternative, a column per claim."""
    shares = compute_shares(multiverse)
    claims = [claim.id for claim in multiverse.claims]
    rows = list(dict.fromkeys((share.choice, share.alternative) for share in shares))
    table = {(share.choice, share.alternative, share.claim): share for share in shares}
    figure = Figure((FIGURE_WIDTH, HEADINGS_HEIGHT + ROW_HEIGHT * len(rows)))
    axes = figure.subplots()
    cells = [[table[(*row, claim)].share for claim in claims] for row in rows]
    draw_cells(
        axes,
        np.array([[share or 0.0 for share in row] for row in cells]),
        [["–" if share is None else format_percentage(share) for share in row] for row in cells],
        WHITE_TO_BLUE,
    )
    _label_claims(axes, [f"{alternative}  {choice}" for choice, alternative in rows], claims)
    _draw_cell_borders(axes, len(claims), [choice for choice, _ in rows])
    return figure


def _label_claims(axes: Axes, rows: list[str], claims: list[str]) -> None:
    """Label rows, and claims above their columns."""
    label_cells(axes, rows, claims)
    axes.tick_params(top=True, labeltop=True, bottom=False, labelbottom=False)
    for label in axes.get_xticklabels():
        label.set_fontweight("bold")


def _draw_cell_borders(axes: Axes, n_columns: int, choices: list[str]) -> None:
    """Draw white lines between cells, and dark lines between the rows of different choices."""
    for column in range(1, n_columns):
        axes.axvline(column - 0.5, color="white", lw=1.5)
    for row, (choice, next_choice) in enumerate(pairwise(choices)):
        color = "white" if choice == next_choice else DARK_GRAY
        axes.axhline(row + 0.5, color=color, lw=1.0)
