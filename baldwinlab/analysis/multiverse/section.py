"""The report section on the variants of a paper: sentences, figures and a table."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

from baldwinlab.analysis.multiverse import analysis, figures
from baldwinlab.analysis.multiverse.records import ClaimText, Multiverse, VariantResult
from baldwinlab.analysis.report.content import format_range
from baldwinlab.analysis.report.embedding import ReportFigure, save_and_inline
from baldwinlab.analysis.report.phrases import format_number, format_signed
from baldwinlab.analysis.report.sections import Section, render
from baldwinlab.analysis.statistics.rules import FAILS, HOLDS, NOT_EVALUATED, UNDECIDED, Verdict
from baldwinlab.papers import load

PHRASES: Final = {HOLDS: "holds", UNDECIDED: "is undecided", FAILS: "does not hold"}
# Largest numbers of variants of which the report lists the names instead of their number.
MAX_NAMED: Final = 8
MAX_NAMED_WITH_STANDARD: Final = 2


class StandardStudy(NamedTuple):
    """A study under the standard variant, whose report has the section."""

    # Verdicts by claim.
    verdicts: Mapping[str, Verdict]
    # Runs of the conditions with the fewest and the most runs.
    runs: tuple[int, int]


def section(multiverse: Multiverse, folder: Path, study: StandardStudy | None = None) -> Section:
    """Make the section of a report on the variants of a paper, and save its figures.

    Parameters
    ----------
    multiverse : Multiverse
        The multiverse.
    folder : Path
        Folder for the figures.
    study : StandardStudy or None
        The study whose report has the section. The section explains why verdicts differ from it.

    Returns
    -------
    Section
        The section.

    Raises
    ------
    OSError
        A figure cannot be written.
    """
    singles = multiverse.singles
    explanation = explain_differences(multiverse, study) if study else ""
    sentences = compose_sentences(singles)
    figures_by_claim = _paper_figures(multiverse)
    body = render(
        "multiverse/section.html",
        n_variants=len(singles.variants),
        choices=singles.choices,
        n_combinations=len(multiverse.variants),
        runs=format_range(count for variant in multiverse.variants for count in variant.runs),
        sentences=[*filter(None, [explanation]), *sentences],
        combinations=describe_combinations(multiverse),
        figures=[save_and_inline(figure, folder) for figure in _draw_figures(multiverse)],
        claims=multiverse.claims,
        paper_figures=figures_by_claim,
        rows=[_make_row(variant, list(figures_by_claim)) for variant in singles.variants],
    )
    return Section(
        "variants", "Variants of the paper", body, short=sentences[0], of_claims=explanation
    )


def explain_differences(multiverse: Multiverse, study: StandardStudy) -> str:
    """Explain why the standard variant and the study have different verdicts.

    Parameters
    ----------
    multiverse : Multiverse
        The multiverse.
    study : StandardStudy
        The study under the standard variant.

    Returns
    -------
    str
        Sentences, or "" if the numbers of runs or the verdicts are equal.
    """
    standard = _standard_variant(multiverse)
    if standard is None or standard.runs == study.runs:
        return ""
    differing: dict[tuple[Verdict, Verdict], list[str]] = {}
    for claim, outcome in standard.outcomes.items():
        verdicts = (study.verdicts.get(claim, NOT_EVALUATED), outcome.verdict)
        if verdicts[0] != verdicts[1] and NOT_EVALUATED not in verdicts:
            differing.setdefault(verdicts, []).append(claim)
    if not differing:
        return ""
    study_runs = format_range(study.runs)
    variant_runs = format_range(standard.runs)
    changes = "; ".join(
        f"{_join(claims)} ({PHRASES[in_study]} with {study_runs}, {PHRASES[in_variant]} with "
        f"{variant_runs})"
        for (in_study, in_variant), claims in differing.items()
    )
    return (
        f"This study has {study_runs} runs of each condition, and every variant has "
        f"{variant_runs}. Some verdicts therefore differ: {changes}. With fewer runs, only larger "
        "differences are significant. Prefer the verdicts of the study with more runs, and compare "
        "variants only with each other."
    )


def _standard_variant(multiverse: Multiverse) -> VariantResult | None:
    return next((variant for variant in multiverse.variants if not variant.choices), None)


def compose_lead(multiverse: Multiverse) -> str:
    """Return the first paragraph of the page of a multiverse."""
    return (
        f"{multiverse.source or load().metadata.source} does not specify all settings. This page "
        "shows which claims depend on these open choices. "
        f"Seed {multiverse.seed}; the value of a run is its average over the last "
        f"{multiverse.last} generations."
    )


def _paper_figures(multiverse: Multiverse) -> dict[str, float]:
    """Return the effect sizes of the paper by claim."""
    return {claim.id: claim.figure for claim in multiverse.claims if claim.figure}


def _make_row(variant: VariantResult, claims: Sequence[str]) -> dict[str, Any]:
    verdicts = [outcome.verdict for outcome in variant.outcomes.values()]
    distance = "–" if variant.distance is None else format_number(variant.distance)
    return {
        "name": variant.name,
        "description": variant.description,
        "counts": [verdicts.count(verdict) for verdict in PHRASES],
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
    held = "; ".join(
        f"{variant.name}: {_list_held(variant) or 'none'}" for variant in singles.variants
    )
    yield ReportFigure(
        "variants",
        "Claims under each variant",
        "Each row is a variant with its changed choice, and each column is a claim. The number is "
        "the effect in the deciding comparison: with a sign, a difference of medians (items per "
        "agent, or a share of agents); without a sign, a level.",
        f"A table of verdicts. Claims that hold, by variant: {held}.",
        figures.draw_variants(multiverse),
        list(_tabulate_outcomes(singles)),
    )
    if multiverse.has_combinations:
        yield ReportFigure(
            "variants-shares",
            "Claims under all combinations",
            "Share of the combinations with an alternative under which a claim holds. A claim "
            "depends on a choice if the rows of the choice differ.",
            " ".join(describe_combinations(multiverse)),
            figures.draw_shares(multiverse),
            [share._asdict() for share in analysis.compute_shares(multiverse)],
        )


def _list_held(variant: VariantResult) -> str:
    return _join([claim for claim, outcome in variant.outcomes.items() if outcome.verdict == HOLDS])


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


def compose_sentences(multiverse: Multiverse) -> list[str]:
    """Return the results of all variants as sentences.

    Parameters
    ----------
    multiverse : Multiverse
        The multiverse, with variants that change a single choice.

    Returns
    -------
    list of str
        Sentences.
    """
    titles = {claim.id: _format_title(claim) for claim in multiverse.claims}
    robust = analysis.select_claims(multiverse, HOLDS)
    return [
        *_describe_robust(multiverse, titles, robust),
        *_describe_nearest(multiverse),
        _describe_most(multiverse),
        *_describe_equal(multiverse),
        *(
            f"{titles[claim.id]} {_describe_verdicts(multiverse, claim.id)}."
            for claim in multiverse.claims
            if claim.id not in robust
        ),
    ]


def _format_title(claim: ClaimText) -> str:
    return f"{claim.id} ({claim.title[0].lower()}{claim.title[1:]})"


def _describe_robust(
    multiverse: Multiverse, titles: Mapping[str, str], robust: Sequence[str]
) -> Iterator[str]:
    """Name the claims that no variant changes."""
    if robust:
        names = _join([titles[claim] for claim in robust])
        yield f"These claims hold under every variant: {names}."
    else:
        yield "No claim holds under every variant."
    unrefuted = analysis.select_claims(multiverse, HOLDS, UNDECIDED)
    if partly := [claim for claim in unrefuted if claim not in robust]:
        yield f"Undecided under some variants, and contradicted by none: {_join(partly)}."
    if never := analysis.select_claims(multiverse, UNDECIDED, FAILS):
        yield f"These claims hold under no variant: {_join(never)}."


def _describe_verdicts(multiverse: Multiverse, claim: str) -> str:
    """Return the verdicts on a claim by variant.

    For example: "holds under the standard variant and 13 others; is undecided under biases (R3)".
    """
    groups = {
        verdict: variants
        for verdict, variants in analysis.group_by_verdict(multiverse, claim).items()
        if variants
    }
    if not groups:
        return "is not evaluated under any variant, because runs are missing"
    if len(groups) == 1:
        (verdict,) = groups
        return f"{PHRASES[verdict]} under {'any' if verdict == FAILS else 'every'} variant"
    parts = [f"{PHRASES[verdict]} under {_name_all(group)}" for verdict, group in groups.items()]
    return "; ".join(parts)


def _name_all(variants: Sequence[VariantResult]) -> str:
    """Return the names of a few variants, or the number of many."""
    nonstandard = [variant for variant in variants if variant.choices]
    has_standard = len(nonstandard) < len(variants)
    if len(nonstandard) <= (MAX_NAMED_WITH_STANDARD if has_standard else MAX_NAMED):
        return _join([_name(variant) for variant in variants])
    if has_standard:
        return f"the standard variant and {len(nonstandard)} others"
    return f"{len(variants)} variants"


def _name(variant: VariantResult) -> str:
    if not variant.choices:
        return "the standard variant"
    return f"{variant.name} ({', '.join(variant.choices)})"


def _describe_nearest(multiverse: Multiverse) -> Iterator[str]:
    nearest = analysis.find_nearest(multiverse)
    if nearest is None or nearest.distance is None:
        return
    paper_figures = _paper_figures(multiverse)
    values = _join([f"{figure:+g} for {claim}" for claim, figure in paper_figures.items()])
    yield (
        f"The variant nearest to the effect sizes of the paper ({values}) is {_name(nearest)}: "
        f"{_list_effects(nearest, paper_figures)}, at a distance of "
        f"{format_number(nearest.distance)}. Under it, {nearest.held} of {len(nearest.outcomes)} "
        "claims hold."
    )
    inside = analysis.variants_with_figures(multiverse)
    names = _name_all(inside) if inside else "no variant"
    yield f"All these values are inside the measured 95 % intervals under {names}."
    standard = _standard_variant(multiverse)
    if standard and standard != nearest and standard.distance is not None:
        yield (
            "The standard variant is at a distance of "
            f"{format_number(standard.distance)}: {_list_effects(standard, paper_figures)}."
        )


def _list_effects(variant: VariantResult, claims: Mapping[str, float]) -> str:
    return _join(
        [f"{format_signed(variant.outcomes[claim].effect or 0)} for {claim}" for claim in claims]
    )


def _describe_most(multiverse: Multiverse) -> str:
    best = analysis.variants_with_most_claims(multiverse)
    if not best or not best[0].held:
        return "No claim holds under any variant."
    held = best[0].held
    count = len(multiverse.claims)
    if held == count:
        return f"Under {_name_all(best)}, all {count} claims hold."
    return f"Under {_name_all(best)}, {held} of {count} claims hold, the highest number."


def _describe_equal(multiverse: Multiverse) -> Iterator[str]:
    """Name the variants with the verdicts and effects of the standard variant."""
    standard = _standard_variant(multiverse)
    if standard is None:
        return
    equal = [
        _name(variant)
        for variant in multiverse.variants
        if variant.choices and _list_results(variant) == _list_results(standard)
    ]
    if equal:
        yield f"All verdicts and effects equal those of the standard variant under {_join(equal)}."


def _list_results(variant: VariantResult) -> list[tuple[Verdict, float | None]]:
    return [(outcome.verdict, outcome.effect) for outcome in variant.outcomes.values()]


def describe_combinations(multiverse: Multiverse) -> list[str]:
    """Return the results of all combinations, one sentence per claim.

    Parameters
    ----------
    multiverse : Multiverse
        The multiverse.

    Returns
    -------
    list of str
        Sentences, or nothing if no variant changes several choices.
    """
    if not multiverse.has_combinations:
        return []
    shares = analysis.compute_shares(multiverse)
    return [_describe_claim(multiverse, claim.id, shares) for claim in multiverse.claims]


def _describe_claim(multiverse: Multiverse, claim: str, shares: Sequence[analysis.Share]) -> str:
    groups = analysis.group_by_verdict(multiverse, claim)
    decided = sum(len(variants) for variants in groups.values())
    if not decided:
        return f"{claim} is not evaluated under any combination, because runs are missing."
    held = len(groups[HOLDS]) / decided
    failed = len(groups[FAILS]) / decided
    text = (
        f"{claim} holds under {held:.0%} of {decided:,} combinations and fails under {failed:.0%}."
    )
    pair = analysis.largest_effect(shares, claim)
    if pair is None or pair[0].share == pair[1].share:
        return text
    largest, smallest = pair
    return (
        f"{text} The choice with the largest effect is {largest.choice}: the claim holds under "
        f"{largest.share:.0%} with {largest.alternative} and {smallest.share:.0%} with "
        f"{smallest.alternative}."
    )


def _join(names: Sequence[str]) -> str:
    """Return a list in words, such as "C1, C2 and C3"."""
    return " and ".join(filter(None, [", ".join(names[:-1]), *names[-1:]]))
