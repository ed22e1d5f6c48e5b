"""Claims of a paper under all of its variants: which claims depend on which open choice.

Within a variant, the p-values of all claims are one family, corrected by Holm's method, as in a
study of the paper. p-values are not corrected across variants, because each variant is compared
only with the paper.

The distance of a variant from the paper is the mean over claims of |effect - figure| / figure, with
the effect size *figure* in the paper. Claims without an effect size are left out. A variant with
the effects of the paper has distance 0, and a variant without any effect has distance 1.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from operator import attrgetter
from pathlib import Path
from typing import Any, Final, NamedTuple, Protocol

import numpy as np
import xarray as xr
from pydantic import ValidationError

from baldwinlab.analysis.claims import evaluate_claims
from baldwinlab.analysis.multiverse.records import ClaimText, Multiverse, Outcome, VariantResult
from baldwinlab.analysis.results.verdicts import FAILS, HOLDS, NOT_EVALUATED, UNDECIDED, Verdict
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.core.files import RESULTS_FILE, parse_json, read_bytes
from baldwinlab.papers import Paper, load
from baldwinlab.papers.claims import EXPLORATORY

# Name of the variant with which all other variants are compared.
STANDARD: Final = "standard"
DECIDED_VERDICTS: Final = (HOLDS, UNDECIDED, FAILS)


class VariantSettings(Protocol):
    """A variant of a paper, before it is evaluated."""

    @property
    def name(self) -> str:
        """Name of the variant."""

    @property
    def description(self) -> str:
        """Description in one line."""

    @property
    def choices(self) -> dict[str, str]:
        """The changed alternatives, by choice."""

    @property
    def fields(self) -> dict[str, Any]:
        """The changed settings, by path."""


def list_claims(paper: Paper | None = None) -> tuple[ClaimText, ...]:
    """Return the claims of a paper, or of the default paper."""
    return tuple(
        ClaimText(
            id=claim.id,
            title=claim.title,
            claim=claim.text,
            figure=claim.paper_value,
            is_exploratory=claim.kind == EXPLORATORY,
        )
        for claim in (paper or load()).claims
    )


def evaluate_variant(
    data: xr.Dataset, variant: VariantSettings, last: int = 10, paper: Paper | None = None
) -> VariantResult:
    """Evaluate the claims of a paper for one variant.

    `data`: the runs (condition, run, generation, agent). Conditions have the names of the paper,
    for example "evo/A". `paper`: defaults to the default paper.
    """
    results = evaluate_claims(data, last, paper)
    # pydantic ignores the keys of a record that are not fields of `Outcome`.
    outcomes = {result.claim.id: Outcome(**result.record()) for result in results}
    n_runs = data["energy"].notnull().any(("generation", "agent")).sum("run").values
    return VariantResult(
        name=variant.name,
        description=variant.description,
        choices=dict(variant.choices),
        fields=dict(variant.fields),
        runs=(int(n_runs.min()), int(n_runs.max())),
        held=sum(
            result.verdict == HOLDS and result.claim.kind != EXPLORATORY for result in results
        ),
        distance=compute_distance(outcomes, paper),
        outcomes=outcomes,
    )


def compute_distance(outcomes: Mapping[str, Outcome], paper: Paper | None = None) -> float | None:
    """Return the mean of |effect - figure| / figure over the claims with an effect size.

    `paper`: defaults to the default paper. The result is None if the paper has no effect size, or
    if the variant lacks an effect.
    """
    claims = (paper or load()).claims
    paper_effects = {claim.id: claim.paper_value for claim in claims if claim.paper_value}
    distances = []
    for claim_id, paper_effect in paper_effects.items():
        effect = outcomes[claim_id].effect if claim_id in outcomes else None
        if effect is None:
            return None
        distances.append(abs(effect - paper_effect) / paper_effect)
    return float(np.mean(distances)) if distances else None


def group_by_verdict(
    multiverse: Multiverse, claim: str
) -> dict[Verdict, tuple[VariantResult, ...]]:
    """Return the variants by the verdict on a claim, except those that do not evaluate it."""
    variants = multiverse.variants
    return {
        verdict: tuple(item for item in variants if item.outcomes[claim].verdict == verdict)
        for verdict in DECIDED_VERDICTS
    }


def select_claims(multiverse: Multiverse, *verdicts: Verdict) -> list[str]:
    """Return the claims with one of the given verdicts under every variant that evaluates them."""
    selected = []
    for claim in multiverse.claims:
        claim_verdicts = {variant.outcomes[claim.id].verdict for variant in multiverse.variants}
        claim_verdicts -= {NOT_EVALUATED}
        if claim_verdicts and claim_verdicts <= set(verdicts):
            selected.append(claim.id)
    return selected


def find_decisive_choices(multiverse: Multiverse, claim: str) -> dict[str, list[str]]:
    """Return the variants that change the verdict on a claim, by the choice that they change.

    Only variants that change a single choice count. The result is empty if the claim is not
    evaluated under the standard variant.
    """
    verdicts = {variant.name: variant.outcomes[claim].verdict for variant in multiverse.variants}
    standard = verdicts.get(STANDARD, NOT_EVALUATED)
    if standard == NOT_EVALUATED:
        return {}
    choices: dict[str, list[str]] = {}
    for variant in multiverse.singles.variants:
        if verdicts[variant.name] not in (standard, NOT_EVALUATED):
            for choice in variant.choices:
                choices.setdefault(choice, []).append(variant.name)
    return choices


def find_nearest(multiverse: Multiverse) -> VariantResult | None:
    """Return the variant nearest to the paper, or None if no variant has a distance.

    Under this variant, the most claims with an effect size hold. Among several such variants, the
    smallest distance decides. The distance alone is not sufficient, because a variant without any
    eaten item has a distance of only 1.
    """
    measured = [variant for variant in multiverse.variants if variant.distance is not None]
    claims_with_effect = [claim.id for claim in multiverse.claims if claim.figure is not None]

    def rank_variant(variant: VariantResult) -> tuple[int, float]:
        n_held = sum(variant.outcomes[claim].verdict == HOLDS for claim in claims_with_effect)
        return -n_held, variant.distance or 0.0  # The minimum is the nearest variant.

    return min(measured, key=rank_variant, default=None)


def variants_with_paper_effects(multiverse: Multiverse) -> list[VariantResult]:
    """Return the variants with intervals that contain all effect sizes of the paper."""
    paper_effects = list_paper_effects(multiverse)

    def has_paper_effects(variant: VariantResult) -> bool:
        intervals = [variant.outcomes[claim].interval for claim in paper_effects]
        pairs = zip(intervals, paper_effects.values(), strict=True)
        return all(ends and ends[0] <= effect <= ends[1] for ends, effect in pairs)

    return [variant for variant in multiverse.variants if has_paper_effects(variant)]


def variants_with_most_claims(multiverse: Multiverse) -> list[VariantResult]:
    """Return the variants under which the most claims hold."""
    maximum = max((variant.held for variant in multiverse.variants), default=0)
    return [variant for variant in multiverse.variants if variant.held == maximum]


class Share(NamedTuple):
    """Share of the combinations with one alternative of a choice under which a claim holds."""

    choice: str
    # Alternative of the choice, or "standard".
    alternative: str
    claim: str
    # Number of combinations under which the claim holds, and number under which it is evaluated.
    held: int
    decided: int

    @property
    def share(self) -> float | None:
        """The share, or None if the claim is evaluated under no combination."""
        return self.held / self.decided if self.decided else None


def find_standard_variant(multiverse: Multiverse) -> VariantResult | None:
    """Return the variant that changes no choice, or None."""
    return next((variant for variant in multiverse.variants if not variant.choices), None)


def list_paper_effects(multiverse: Multiverse) -> dict[str, float]:
    """Return the effect sizes of the paper by claim."""
    return {claim.id: claim.figure for claim in multiverse.claims if claim.figure}


def compute_shares(multiverse: Multiverse) -> list[Share]:
    """Count the combinations under which each claim holds, by choice and alternative."""
    groups: dict[str, dict[str, list[VariantResult]]] = {
        choice: {STANDARD: []} for choice in multiverse.choices
    }
    for variant in multiverse.variants:
        for choice, alternatives in groups.items():
            alternatives.setdefault(variant.choices.get(choice, STANDARD), []).append(variant)
    shares = []
    for choice, alternatives in groups.items():
        for alternative, variants in alternatives.items():
            for claim in multiverse.claims:
                verdicts = [variant.outcomes[claim.id].verdict for variant in variants]
                n_decided = sum(verdict in DECIDED_VERDICTS for verdict in verdicts)
                held = verdicts.count(HOLDS)
                shares.append(Share(choice, alternative, claim.id, held, n_decided))
    return shares


def find_largest_effect(shares: Sequence[Share], claim: str) -> tuple[Share, Share] | None:
    """Return the largest and smallest share of the choice with the largest effect on a claim."""
    groups: dict[str, list[Share]] = {}
    for share in shares:
        if share.claim == claim and share.decided:
            groups.setdefault(share.choice, []).append(share)
    pairs = [
        (max(group, key=attrgetter("share")), min(group, key=attrgetter("share")))
        for group in groups.values()
    ]
    return max(pairs, key=lambda ends: (ends[0].share or 0) - (ends[1].share or 0), default=None)


def summarize(multiverse: Multiverse) -> dict[str, Any]:
    """Return the results that the report describes in sentences, for JSON."""
    nearest = find_nearest(multiverse)
    shares = compute_shares(multiverse) if multiverse.has_combinations else None
    return {
        "hold_under_every_variant": select_claims(multiverse, HOLDS),
        "refuted_under_no_variant": select_claims(multiverse, HOLDS, UNDECIDED),
        "hold_under_no_variant": select_claims(multiverse, UNDECIDED, FAILS),
        "depends_on": {
            claim.id: find_decisive_choices(multiverse, claim.id) for claim in multiverse.claims
        },
        "nearest": nearest
        and {"variant": nearest.name, "distance": nearest.distance, "held": nearest.held},
        "intervals_contain_the_figures": [
            variant.name for variant in variants_with_paper_effects(multiverse)
        ],
        "most_held": [variant.name for variant in variants_with_most_claims(multiverse)],
        "shares": None if shares is None else [share._asdict() for share in shares],
    }


def write_multiverse(multiverse: Multiverse, path: Path) -> Path:
    """Write a multiverse as JSON, atomically, with null for undefined numbers."""
    record = {
        "checksum": _checksum(multiverse),
        "summary": summarize(multiverse),
        **multiverse.model_dump(mode="json"),
    }
    text = json.dumps(record, indent=1, ensure_ascii=False, allow_nan=False)
    return write_atomically(path, f"{text}\n".encode())


def read_multiverse(path: Path) -> Multiverse:
    """Read a file of `write_multiverse`."""
    raw = _read_bytes(path)
    try:
        record = parse_json(raw)
        multiverse = Multiverse.model_validate(record)
    except ValidationError as error:
        key = ".".join(str(part) for part in error.errors()[0]["loc"]) or "it is not an object"
        raise ValueError(f"{path} is not a file of `baldwinlab multiverse`: {key}") from None
    except ValueError:
        raise ValueError(f"{path} is not a file of `baldwinlab multiverse`: not JSON") from None
    is_complete = record.get("checksum") == _checksum(multiverse)
    if not is_complete or record.get("summary") != summarize(multiverse):
        raise ValueError(
            f"{path} was changed after `baldwinlab multiverse` wrote it. Run that command again."
        )
    return multiverse


def _read_bytes(path: Path) -> bytes:
    try:
        return read_bytes(path, RESULTS_FILE)
    except ValueError as error:
        raise ValueError(f"{path} cannot be read: {error}") from None


def _checksum(multiverse: Multiverse) -> str:
    """Return the SHA-256 of a multiverse. The file's summary is not part of it."""
    return hashlib.sha256(multiverse.model_dump_json().encode()).hexdigest()
