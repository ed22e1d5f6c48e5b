"""Report section on the variants of a paper: sentences, figures and a table."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from baldwinlab.analysis.multiverse import analysis, figures
from baldwinlab.analysis.multiverse.records import Multiverse, VariantResult
from baldwinlab.analysis.multiverse.sentences import (
    VERDICT_PHRASES,
    compose_sentences,
    describe_combinations,
    join_names,
)
from baldwinlab.analysis.report.content import format_range
from baldwinlab.analysis.report.embedding import ReportFigure, save_and_inline
from baldwinlab.analysis.report.sections import Section, render
from baldwinlab.analysis.statistics.numbers import format_number, format_signed
from baldwinlab.analysis.statistics.rules import HOLDS, NOT_EVALUATED, Verdict
from baldwinlab.papers import load


class StandardStudy(NamedTuple):
    """A study under the standard variant, whose report has the section."""

    # Verdicts by claim.
    verdicts: Mapping[str, Verdict]
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
        rows=[_make_row(variant, list(paper_effects)) for variant in singles.variants],
    )
    return Section(
        anchor="variants",
        title="Variants of the paper",
        body=body,
        summary=sentences[0],
        claims_note=explanation,
    )


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


def _make_row(variant: VariantResult, claims: Sequence[str]) -> dict[str, Any]:
    verdicts = [outcome.verdict for outcome in variant.outcomes.values()]
    distance = "–" if variant.distance is None else format_number(variant.distance)
    return {
        "name": variant.name,
        "description": variant.description,
        "counts": [verdicts.count(verdict) for verdict in VERDICT_PHRASES],
        "effects": [_format_effect(variant, claim) for claim in claims],
        "distance": distance,
    }


def _format_effect(variant: VariantResult, claim: str) -> str:
    outcome = variant.outcomes[claim]
    if outcome.effect is None:
        return "–"
    effect = format_signed(outcome.effect)
    if not outcome.interval:
        return effect
    low, high = outcome.interval
    return f"{effect} [{format_number(low)}, {format_number(high)}]"


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
        figure=figures.draw_variants(multiverse),
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
            figure=figures.draw_shares(multiverse),
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
