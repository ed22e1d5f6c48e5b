"""Sentences about a multiverse for `section.py`: robust claims, nearest variant, verdicts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from baldwinlab.analysis.multiverse import analysis
from baldwinlab.analysis.multiverse.records import ClaimText, Multiverse, VariantResult
from baldwinlab.analysis.results.numbers import (
    format_number,
    format_percentage,
    format_signed,
    join_names,
)
from baldwinlab.analysis.results.verdicts import FAILS, HOLDS, UNDECIDED, Verdict

VERDICT_PHRASES: Final[Mapping[Verdict, str]] = {
    HOLDS: "holds",
    UNDECIDED: "is undecided",
    FAILS: "does not hold",
}
# Largest numbers of variants that a sentence names. It states larger numbers without the names.
MAX_NAMED: Final = 8
MAX_NAMED_WITH_STANDARD: Final = 2


def compose_sentences(multiverse: Multiverse) -> list[str]:
    """Return the results of all variants as sentences."""
    titles = {claim.id: _format_title(claim) for claim in multiverse.claims}
    robust = analysis.select_claims(multiverse, HOLDS)
    return [
        *_describe_robust_claims(multiverse, titles, robust),
        *_describe_nearest(multiverse),
        _describe_most_claims(multiverse),
        *_describe_equal_variants(multiverse),
        *(
            f"{titles[claim.id]} {_describe_verdicts(multiverse, claim.id)}."
            for claim in multiverse.claims
            if claim.id not in robust
        ),
    ]


def _format_title(claim: ClaimText) -> str:
    return f"{claim.id} ({claim.title[0].lower()}{claim.title[1:]})"


def _describe_robust_claims(
    multiverse: Multiverse, titles: Mapping[str, str], robust: Sequence[str]
) -> Iterator[str]:
    """Yield sentences on the claims that hold under every variant, or under none."""
    if robust:
        names = join_names([titles[claim] for claim in robust])
        yield f"These claims hold under every variant: {names}."
    else:
        yield "No claim holds under every variant."
    unrefuted = analysis.select_claims(multiverse, HOLDS, UNDECIDED)
    if undecided_claims := [claim for claim in unrefuted if claim not in robust]:
        names = join_names(undecided_claims)
        yield f"Undecided under some variants, and contradicted by none: {names}."
    if failing_claims := analysis.select_claims(multiverse, UNDECIDED, FAILS):
        yield f"These claims hold under no variant: {join_names(failing_claims)}."


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
        determiner = "any" if verdict == FAILS else "every"
        return f"{VERDICT_PHRASES[verdict]} under {determiner} variant"
    parts = [
        f"{VERDICT_PHRASES[verdict]} under {_name_variants(group)}"
        for verdict, group in groups.items()
    ]
    return "; ".join(parts)


def _name_variants(variants: Sequence[VariantResult]) -> str:
    """Return the names of a few variants, or "the standard variant and 13 others", for example."""
    nonstandard = [variant for variant in variants if variant.choices]
    has_standard = len(nonstandard) < len(variants)
    max_named = MAX_NAMED_WITH_STANDARD if has_standard else MAX_NAMED
    if len(nonstandard) <= max_named:
        return join_names([_name_variant(variant) for variant in variants])
    if has_standard:
        return f"the standard variant and {len(nonstandard)} others"
    return f"{len(variants)} variants"


def _name_variant(variant: VariantResult) -> str:
    if not variant.choices:
        return "the standard variant"
    return f"{variant.name} ({', '.join(variant.choices)})"


def _describe_nearest(multiverse: Multiverse) -> Iterator[str]:
    nearest = analysis.find_nearest(multiverse)
    if nearest is None or nearest.distance is None:
        return
    paper_effects = analysis.list_paper_effects(multiverse)
    values = join_names([f"{figure:+g} for {claim}" for claim, figure in paper_effects.items()])
    yield (
        f"The variant nearest to the effect sizes of the paper ({values}) is "
        f"{_name_variant(nearest)}: {_list_effects(nearest, paper_effects)}, at a distance of "
        f"{format_number(nearest.distance)}. Under it, {nearest.held} of "
        f"{multiverse.n_counted_claims} claims hold."
    )
    agreeing_variants = analysis.variants_with_paper_effects(multiverse)
    names = _name_variants(agreeing_variants) if agreeing_variants else "no variant"
    yield f"All these values are inside the measured 95 % intervals under {names}."
    standard = analysis.find_standard_variant(multiverse)
    if standard and standard != nearest and standard.distance is not None:
        yield (
            "The standard variant is at a distance of "
            f"{format_number(standard.distance)}: {_list_effects(standard, paper_effects)}."
        )


def _list_effects(variant: VariantResult, claims: Mapping[str, float]) -> str:
    return join_names(
        [f"{format_signed(variant.outcomes[claim].effect or 0)} for {claim}" for claim in claims]
    )


def _describe_most_claims(multiverse: Multiverse) -> str:
    best = analysis.variants_with_most_claims(multiverse)
    if not best or not best[0].held:
        return "No claim holds under any variant."
    n_held = best[0].held
    n_claims = multiverse.n_counted_claims
    if n_held == n_claims:
        return f"Under {_name_variants(best)}, all {n_claims} claims hold."
    return f"Under {_name_variants(best)}, {n_held} of {n_claims} claims hold, the highest number."


def _describe_equal_variants(multiverse: Multiverse) -> Iterator[str]:
    """Yield a sentence that names the variants with the same results as the standard variant."""
    standard = analysis.find_standard_variant(multiverse)
    if standard is None:
        return
    names = [
        _name_variant(variant)
        for variant in multiverse.variants
        if variant.choices and _list_results(variant) == _list_results(standard)
    ]
    if names:
        yield (
            "All verdicts and effects equal those of the standard variant under "
            f"{join_names(names)}."
        )


def _list_results(variant: VariantResult) -> list[tuple[Verdict, float | None]]:
    return [(outcome.verdict, outcome.effect) for outcome in variant.outcomes.values()]


def describe_combinations(multiverse: Multiverse) -> list[str]:
    """Return the results of all combinations, one sentence per claim."""
    if not multiverse.has_combinations:
        return []
    shares = analysis.compute_shares(multiverse)
    return [_describe_claim(multiverse, claim.id, shares) for claim in multiverse.claims]


def _describe_claim(multiverse: Multiverse, claim: str, shares: Sequence[analysis.Share]) -> str:
    groups = analysis.group_by_verdict(multiverse, claim)
    n_decided = sum(len(variants) for variants in groups.values())
    if not n_decided:
        return f"{claim} is not evaluated under any combination, because runs are missing."
    held, failed = (format_percentage(len(groups[key]) / n_decided) for key in (HOLDS, FAILS))
    text = f"{claim} holds under {held} of {n_decided:,} combinations and fails under {failed}."
    pair = analysis.find_largest_effect(shares, claim)
    if pair is None:
        return text
    largest, smallest = pair
    if largest.share == smallest.share:
        return text
    most, least = (format_percentage(share.share or 0.0) for share in pair)
    return (
        f"{text} The choice with the largest effect is {largest.choice}: the claim holds under "
        f"{most} with {largest.alternative} and {least} with {smallest.alternative}."
    )
