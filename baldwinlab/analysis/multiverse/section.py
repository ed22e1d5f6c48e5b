"""What every variant of the paper says of its claims: figures, a table, and a verdict in plain language."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from baldwinlab.analysis.multiverse import analysis, figures
from baldwinlab.analysis.multiverse.analysis import Multiverse, Variant
from baldwinlab.analysis.report.content import span
from baldwinlab.analysis.report.figures import Picture, embed
from baldwinlab.analysis.report.phrases import number, signed
from baldwinlab.analysis.report.sections import Section, render
from baldwinlab.analysis.statistics.rules import FAILS, HOLDS, NOT_EVALUATED, UNDECIDED, Verdict
from baldwinlab.papers import load

WORDS = {HOLDS: "holds", UNDECIDED: "is undecided", FAILS: "does not hold"}
FEW, MANY = 2, 8  # variants beside the standard that are named, and without it; more are counted


class Beside(NamedTuple):
    """The study under the standard variant in whose report the section stands."""

    verdicts: Mapping[str, Verdict]  # by claim
    runs: tuple[int, int]  # of the condition with the fewest, and with the most


def section(multiverse: Multiverse, folder: Path, study: Beside | None = None) -> Section:
    """The section "Every variant" of a report. Its figures are kept in `folder` as SVG and PNG. Raises OSError.

    Where it stands in the report of a `study`, it says why verdicts differ between the two.
    """
    singles = multiverse.singles
    why = other_runs(multiverse, study) if study else ""
    said = verdict(singles)
    body = render(
        "multiverse/section.html",
        variants=len(singles.variants),
        choices=_listed(singles.choices),
        open=len(singles.choices),
        combinations=len(multiverse.variants),
        runs=span(count for variant in multiverse.variants for count in variant.runs),
        sentences=[*filter(None, [why]), *said],
        sentences_of_combinations=combinations(multiverse),
        figures=[embed(picture, folder) for picture in _pictures(multiverse)],
        claims=multiverse.claims,
        sized=_sized(multiverse),
        rows=[_row(variant, list(_sized(multiverse))) for variant in singles.variants],
    )
    return Section("every-variant", "Every variant", body, short=said[0], of_claims=why)


def other_runs(multiverse: Multiverse, study: Beside) -> str:
    """Why the standard variant has other verdicts here than in a study of other runs; nothing where it has not."""
    standard = next((variant for variant in multiverse.variants if not variant.choices), None)
    if standard is None or standard.runs == study.runs:
        return ""
    differing: dict[tuple[Verdict, Verdict], list[str]] = {}
    for name, outcome in standard.outcomes.items():
        there, here = study.verdicts.get(name, NOT_EVALUATED), outcome.verdict
        if there != here and NOT_EVALUATED not in (there, here):
            differing.setdefault((there, here), []).append(name)
    if not differing:
        return ""
    verdicts = "; ".join(
        f"{_listed(names)} ({WORDS[there]} with {span(study.runs)}, {WORDS[here]} with {span(standard.runs)})"
        for (there, here), names in differing.items()
    )
    return (
        f"The study and the standard variant differ in their number of runs alone, {span(study.runs)} of each condition and "
        f"{span(standard.runs)} under every variant, so some verdicts differ: {verdicts}. That is no contradiction: the fewer "
        "runs there are, the larger a difference must be to be told from chance, and undecided says only that these runs cannot "
        "tell. Trust the verdicts of more runs; compare variants with each other, as they have equally many."
    )


def lead(multiverse: Multiverse) -> str:
    """What a page of its own begins with."""
    return (
        f"{multiverse.source or load().about.source} leaves choices open. "
        "Here they are made otherwise, to see which of its claims depend on them. "
        f"Seed {multiverse.seed}; each run counts with its average over the last {multiverse.last} generations."
    )


def _sized(multiverse: Multiverse) -> dict[str, float]:
    """The paper's figures for the size of an effect, by claim."""
    return {claim.id: claim.figure for claim in multiverse.claims if claim.figure}


def _row(variant: Variant, sized: Sequence[str]) -> dict[str, Any]:
    verdicts = [outcome.verdict for outcome in variant.outcomes.values()]
    return {
        "name": variant.name,
        "description": variant.description,
        "counts": [verdicts.count(name) for name in WORDS],
        "effects": [_effect(variant, claim) for claim in sized],
        "distance": "–" if variant.distance is None else number(variant.distance),
    }


def _effect(variant: Variant, claim: str) -> str:
    outcome = variant.outcomes[claim]
    if outcome.effect is None:
        return "–"
    interval = (
        f" [{number(outcome.interval[0])}, {number(outcome.interval[1])}]"
        if outcome.interval
        else ""
    )
    return signed(outcome.effect) + interval


def _pictures(multiverse: Multiverse) -> Iterator[Picture]:
    singles = multiverse.singles
    held = [
        f"{variant.name}: {_listed([name for name, outcome in variant.outcomes.items() if outcome.verdict == HOLDS]) or 'none'}"
        for variant in singles.variants
    ]
    yield Picture(
        "variants",
        "The claims under each variant",
        "A row for each variant, with the choice that it makes otherwise; a column for each claim. The number is the effect in "
        "the comparison that decides: with a sign, a difference of medians (items an agent, or a share of agents); "
        "without, a level.",
        f"A table of verdicts. Claims that hold, by variant: {'; '.join(held)}.",
        figures.variants(multiverse),
        list(_outcomes(singles)),
    )
    if multiverse.combined:
        yield Picture(
            "variants-shares",
            "The claims under all combinations",
            "Of all combinations that take one alternative of a choice, the share under which a claim holds. Where the rows of a "
            "choice differ, the claim depends on it.",
            " ".join(combinations(multiverse)),
            figures.variants_shares(multiverse),
            [share._asdict() for share in analysis.shares(multiverse)],
        )


def _outcomes(multiverse: Multiverse) -> Iterator[dict[str, Any]]:
    """A row a variant and claim."""
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


def verdict(multiverse: Multiverse) -> list[str]:
    """What came of variants that make a single choice otherwise, a sentence each, from the numbers alone."""
    titles = {
        claim.id: f"{claim.id} ({claim.title[0].lower()}{claim.title[1:]})"
        for claim in multiverse.claims
    }
    always = analysis.always(multiverse, HOLDS)
    unrefuted = [
        claim for claim in analysis.always(multiverse, HOLDS, UNDECIDED) if claim not in always
    ]
    never = analysis.always(multiverse, UNDECIDED, FAILS)
    return [
        f"No single open choice overturns what holds under every variant: {_listed([titles[claim] for claim in always])}."
        if always
        else "No claim holds under every variant.",
        *(
            [
                f"Contradicted under no variant, though under some these runs cannot tell: {_listed(unrefuted)}."
            ]
            if unrefuted
            else []
        ),
        *([f"Holding under no variant: {_listed(never)}."] if never else []),
        *_nearness(multiverse),
        _most(multiverse),
        *_without_effect(multiverse),
        *(
            f"{titles[claim.id]} {_standing(multiverse, claim.id)}."
            for claim in multiverse.claims
            if claim.id not in always
        ),
    ]


def _standing(multiverse: Multiverse, claim: str) -> str:
    """Such as: holds under the standard variant and 13 others; is undecided under biases (R3)."""
    groups = {
        name: found for name, found in analysis.by_verdict(multiverse, claim).items() if found
    }
    if len(groups) == 1:
        (only,) = groups
        return f"{WORDS[only]} under {'any' if only == FAILS else 'every'} variant"
    parts = [f"{WORDS[name]} under {_named(found)}" for name, found in groups.items()]
    return "; ".join(parts) or "is not decided under any variant, for want of runs"


def _named(found: Sequence[Variant]) -> str:
    """By name, with the choice; of those beside the standard variant, or of very many, the number."""
    others = [variant for variant in found if variant.choices]
    with_standard = len(others) < len(found)
    if len(others) <= (FEW if with_standard else MANY):
        return _listed([_name(variant) for variant in found])
    return (
        f"the standard variant and {len(others)} others"
        if with_standard
        else f"{len(found)} variants"
    )


def _name(variant: Variant) -> str:
    return (
        f"{variant.name} ({', '.join(variant.choices)})"
        if variant.choices
        else "the standard variant"
    )


def _nearness(multiverse: Multiverse) -> Iterator[str]:
    near = analysis.nearest(multiverse)
    if near is None or near.distance is None:
        return
    sized = _sized(multiverse)
    paper = _listed([f"{figure:+g} for {claim}" for claim, figure in sized.items()])
    yield (
        f"Nearest to the paper's own figures ({paper}) comes {_name(near)}: {_effects(near, sized)}, at a distance of "
        f"{number(near.distance)}; under it {near.held} of {len(near.outcomes)} claims hold."
    )
    inside = analysis.containing(multiverse)
    yield f"These figures all lie inside the measured 95 % intervals under {_named(inside) if inside else 'no variant'}."
    for variant in multiverse.variants:
        if not variant.choices and variant != near and variant.distance is not None:
            yield f"The standard variant is at a distance of {number(variant.distance)}: {_effects(variant, sized)}."


def _effects(variant: Variant, claims: dict[str, float]) -> str:
    return _listed(
        [f"{signed(variant.outcomes[claim].effect or 0)} for {claim}" for claim in claims]
    )


def _most(multiverse: Multiverse) -> str:
    best = analysis.most_held(multiverse)
    if not best or not best[0].held:
        return "No claim holds under any variant."
    held, count = best[0].held, len(multiverse.claims)
    number_held = (
        f"all {count} claims hold"
        if held == count
        else f"{held} of {count} claims hold, and under no other do more"
    )
    return f"Under {_named(best)}, {number_held}."


def _without_effect(multiverse: Multiverse) -> Iterator[str]:
    came = [
        (variant, [(outcome.verdict, outcome.effect) for outcome in variant.outcomes.values()])
        for variant in multiverse.variants
    ]
    standard = [found for variant, found in came if not variant.choices]
    same = [_name(variant) for variant, found in came if variant.choices and found in standard]
    if same:
        yield f"Every verdict and every effect is the standard variant's under {_listed(same)}."


def combinations(multiverse: Multiverse) -> list[str]:
    """What came of all combinations, a sentence a claim; nothing where there are none."""
    if not multiverse.combined:
        return []
    found = analysis.shares(multiverse)
    return [_combined(multiverse, claim.id, found) for claim in multiverse.claims]


def _combined(multiverse: Multiverse, claim: str, found: Sequence[analysis.Share]) -> str:
    counts = {
        name: len(variants) for name, variants in analysis.by_verdict(multiverse, claim).items()
    }
    decided = sum(counts.values())
    if not decided:
        return f"{claim} is not decided under any combination, for want of runs."
    held, failed = counts[HOLDS] / decided, counts[FAILS] / decided
    text = (
        f"{claim} holds under {held:.0%} of {decided:,} combinations, does not under {failed:.0%}"
    )
    ends = analysis.weightiest(found, claim)
    if ends is None or ends[0].share == ends[1].share:
        return f"{text}."
    most, least = (f"{end.share:.0%} with {end.alternative}" for end in ends)
    return f"{text}; the choice that moves it most is {ends[0].choice}: {most}, {least}."


def _listed(names: Sequence[str]) -> str:
    """Such as: C1, C2 and C3."""
    return " and ".join(filter(None, [", ".join(names[:-1]), *names[-1:]]))
