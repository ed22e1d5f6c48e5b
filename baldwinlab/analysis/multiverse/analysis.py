"""The paper's claims under every variant of the paper: which of them depend on what the paper leaves open, and on what.

Within a variant, all tests of all claims are one family, corrected by Holm's method, as in a study of the paper. Between
variants nothing is corrected: each is held against the paper as if it were the only one.

How near a variant comes to the paper's own figures is its distance: the mean of |effect - figure| / figure over the claims for
which the paper gives a size (C1 and C2, 40 items each). 0 is the paper's own result; 1 is as far off as no effect at all.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from pydantic import BaseModel, ConfigDict, ValidationError

from baldwinlab.analysis.claims import evaluate
from baldwinlab.analysis.statistics.rules import FAILS, HOLDS, NOT_EVALUATED, UNDECIDED, Verdict
from baldwinlab.core.files import RESULTS_FILE, read_bytes, write_atomically
from baldwinlab.papers import Paper, load

STANDARD = "standard"  # the name of the variant that every other one is held against
DECIDED = (HOLDS, UNDECIDED, FAILS)


class _Record(BaseModel):
    model_config = ConfigDict(frozen=True, allow_inf_nan=False)


class Outcome(_Record):
    """What a claim came to: the numbers of the comparison that decided, None where there are none."""

    verdict: Verdict
    condition: str | None = None
    comparison: str | None = None
    measure: str | None = None
    effect: float | None = None
    interval: tuple[float, float] | None = None
    p_holm: float | None = None
    a12: float | None = None


class Claim(_Record):
    id: str
    title: str
    claim: str
    figure: float | None  # the paper's own, items an agent


class Variant(_Record):
    """One variant of the paper, and what its runs say of the claims."""

    name: str
    description: str
    choices: dict[str, str]  # the alternative taken, by choice; none in the standard variant
    fields: dict[str, Any]  # what they set: {"contact.reach": 5}
    runs: tuple[int, int]  # of the condition with the fewest, and with the most
    held: int  # claims that hold
    distance: float | None  # from the paper's figures
    outcomes: dict[str, Outcome]  # by claim


class Multiverse(_Record):
    seed: int
    last: int  # a run counts with its average over so many last generations
    claims: tuple[Claim, ...]
    variants: tuple[Variant, ...]
    source: str = ""  # authors, title and place of the paper

    @property
    def singles(self) -> Multiverse:
        """The standard variant, and those that make a single choice otherwise."""
        return self.model_copy(
            update={
                "variants": tuple(variant for variant in self.variants if len(variant.choices) < 2)
            }
        )

    @property
    def combined(self) -> bool:
        return len(self.singles.variants) < len(self.variants)

    @property
    def choices(self) -> list[str]:
        """The choices that are left open, by name."""
        return sorted({choice for variant in self.variants for choice in variant.choices})


def paper_claims(paper: Paper | None = None) -> tuple[Claim, ...]:
    claims = (paper or load()).claims
    return tuple(
        Claim(id=claim.id, title=claim.title, claim=claim.text, figure=claim.figure)
        for claim in claims
    )


def evaluate_variant(
    dataset: xr.Dataset,
    name: str,
    description: str,
    choices: Mapping[str, str],
    fields: Mapping[str, Any],
    last: int = 10,
    paper: Paper | None = None,
) -> Variant:
    """The claims of a paper (the default unless given) decided for one variant.

    `study` has the dimensions (condition, run, generation, agent), its conditions named as the paper's: evo/A. Raises ValueError
    unless `last` is at least 1.
    """
    outcomes = {
        result.claim.id: _outcome(result.record()) for result in evaluate(dataset, last, paper)
    }
    counts = dataset["energy"].notnull().any(("generation", "agent")).sum("run").values
    return Variant(
        name=name,
        description=description,
        choices=dict(choices),
        fields=dict(fields),
        runs=(int(counts.min()), int(counts.max())),
        held=sum(outcome.verdict == HOLDS for outcome in outcomes.values()),
        distance=distance(outcomes, paper),
        outcomes=outcomes,
    )


def _outcome(record: Mapping[str, Any]) -> Outcome:
    return Outcome(**{name: record[name] for name in Outcome.model_fields})


def distance(outcomes: Mapping[str, Outcome], paper: Paper | None = None) -> float | None:
    """The mean of |effect - figure| / figure over the claims for which the paper gives a size.

    None where it gives none, or one of them lacks an effect.
    """
    sizes = {claim.id: claim.figure for claim in (paper or load()).claims if claim.figure}
    effects = {claim: outcomes[claim].effect for claim in sizes if claim in outcomes}
    found = [
        abs(effect - sizes[claim]) / sizes[claim]
        for claim, effect in effects.items()
        if effect is not None
    ]
    return float(np.mean(found)) if sizes and len(found) == len(sizes) else None


def by_verdict(multiverse: Multiverse, claim: str) -> dict[Verdict, tuple[Variant, ...]]:
    """The variants under which a claim holds, is undecided, and does not hold. One that lacks its runs is in none."""
    return {
        verdict: tuple(
            variant for variant in multiverse.variants if variant.outcomes[claim].verdict == verdict
        )
        for verdict in DECIDED
    }


def always(multiverse: Multiverse, *verdicts: Verdict) -> list[str]:
    """The claims that have one of these verdicts under every variant that decides them, and are decided under any."""
    found = []
    for claim in multiverse.claims:
        seen = {variant.outcomes[claim.id].verdict for variant in multiverse.variants} - {
            NOT_EVALUATED
        }
        if seen and seen <= set(verdicts):
            found.append(claim.id)
    return found


def overturning(multiverse: Multiverse, claim: str) -> dict[str, list[str]]:
    """The choices on which a claim depends, each with the variants that change its verdict from the standard variant's.

    Empty where the standard variant has not decided it. Only variants that make a single choice otherwise count.
    """
    verdicts = {variant.name: variant.outcomes[claim].verdict for variant in multiverse.variants}
    unchanged = {verdicts.get(STANDARD, NOT_EVALUATED), NOT_EVALUATED}
    found: dict[str, list[str]] = {}
    if STANDARD in verdicts and len(unchanged) > 1:
        for variant in multiverse.singles.variants:
            for choice in variant.choices if verdicts[variant.name] not in unchanged else ():
                found.setdefault(choice, []).append(variant.name)
    return found


def nearest(multiverse: Multiverse) -> Variant | None:
    """The variant nearest to the paper: of those under which the most claims with a figure hold, that of the least distance.

    Without the first condition, a variant under which nobody eats would come near: it is at distance 1.
    """
    measured = [variant for variant in multiverse.variants if variant.distance is not None]
    with_figure = [claim.id for claim in multiverse.claims if claim.figure is not None]

    def rank(variant: Variant) -> tuple[int, float]:
        return -sum(
            variant.outcomes[claim].verdict == HOLDS for claim in with_figure
        ), variant.distance or 0.0

    return min(measured, key=rank, default=None)


def containing(multiverse: Multiverse) -> list[Variant]:
    """The variants whose intervals contain the paper's figure for every claim that has a size."""
    sizes = {claim.id: claim.figure for claim in multiverse.claims if claim.figure}

    def contains(variant: Variant) -> bool:
        intervals = [(variant.outcomes[claim].interval, size) for claim, size in sizes.items()]
        return all(
            interval is not None and interval[0] <= size <= interval[1]
            for interval, size in intervals
        )

    return [variant for variant in multiverse.variants if contains(variant)]


def most_held(multiverse: Multiverse) -> list[Variant]:
    """The variants under which the most claims hold."""
    most = max((variant.held for variant in multiverse.variants), default=0)
    return [variant for variant in multiverse.variants if variant.held == most]


class Share(NamedTuple):
    """Of the combinations with one alternative of a choice, those under which a claim holds."""

    choice: str
    alternative: str  # "standard", or the name of a variant
    claim: str
    held: int
    decided: int

    @property
    def share(self) -> float | None:
        return self.held / self.decided if self.decided else None


def shares(multiverse: Multiverse) -> list[Share]:
    """For each choice, each of its alternatives (the standard first) and each claim, how many combinations hold the claim."""
    taken: dict[str, dict[str, list[Variant]]] = {
        choice: {STANDARD: []} for choice in _choices(multiverse.variants)
    }
    for variant in multiverse.variants:
        for choice, group in taken.items():
            group.setdefault(variant.choices.get(choice, STANDARD), []).append(variant)
    return [
        Share(choice, alternative, claim.id, *_held(group, claim.id))
        for choice, groups in taken.items()
        for alternative, group in groups.items()
        for claim in multiverse.claims
    ]


def _choices(variants: Iterable[Variant]) -> list[str]:
    return sorted({choice for variant in variants for choice in variant.choices})


def _held(variants: Sequence[Variant], claim: str) -> tuple[int, int]:
    verdicts = [variant.outcomes[claim].verdict for variant in variants]
    return verdicts.count(HOLDS), sum(verdict in DECIDED for verdict in verdicts)


def weightiest(found: Sequence[Share], claim: str) -> tuple[Share, Share] | None:
    """Of the choice that moves a claim most: the alternatives of the largest and of the smallest share."""
    ends = []
    for choice in dict.fromkeys(share.choice for share in found):
        group = [
            share
            for share in found
            if share.choice == choice and share.claim == claim and share.share is not None
        ]
        if group:
            ends.append(
                (
                    max(group, key=lambda one: one.share or 0),
                    min(group, key=lambda one: one.share or 0),
                )
            )
    return max(ends, key=lambda pair: (pair[0].share or 0) - (pair[1].share or 0), default=None)


def summary(multiverse: Multiverse) -> dict[str, Any]:
    """What all variants come to, for JSON: the facts behind the report's sentences."""
    near = nearest(multiverse)
    return {
        "hold_under_every_variant": always(multiverse, HOLDS),
        "refuted_under_no_variant": always(multiverse, HOLDS, UNDECIDED),
        "hold_under_no_variant": always(multiverse, UNDECIDED, FAILS),
        "depends_on": {claim.id: overturning(multiverse, claim.id) for claim in multiverse.claims},
        "nearest": near and {"variant": near.name, "distance": near.distance, "held": near.held},
        "intervals_contain_the_figures": [variant.name for variant in containing(multiverse)],
        "most_held": [variant.name for variant in most_held(multiverse)],
        "shares": [share._asdict() for share in shares(multiverse)]
        if multiverse.combined
        else None,
    }


def write(multiverse: Multiverse, path: Path) -> Path:
    """Write all of it as JSON, whole or not at all; null where a number does not exist. Raises OSError."""
    record = {
        "checksum": _checksum(multiverse),
        "summary": summary(multiverse),
        **multiverse.model_dump(mode="json"),
    }
    return write_atomically(
        path, (json.dumps(record, indent=1, ensure_ascii=False, allow_nan=False) + "\n").encode()
    )


def read(path: Path) -> Multiverse:
    """What `write` wrote. Raises ValueError for a file of another kind, OSError for one that cannot be read."""
    try:
        raw = _bytes_of(path)
        found = Multiverse.model_validate_json(raw)
    except ValidationError as error:
        place = ".".join(str(step) for step in error.errors()[0]["loc"])
        raise ValueError(
            f"{path} is not what `baldwinlab multiverse` writes: {place or 'it is no JSON'}"
        ) from None
    record = json.loads(raw)
    if "checksum" in record and (
        record["checksum"] != _checksum(found) or record["summary"] != summary(found)
    ):
        raise ValueError(
            f"{path} has been changed since `baldwinlab multiverse` wrote it; that command makes it again"
        )
    return found


def _bytes_of(path: Path) -> bytes:
    try:
        return read_bytes(path, RESULTS_FILE)
    except ValueError as error:
        raise ValueError(f"{path} cannot be read: {error}") from None


def _checksum(multiverse: Multiverse) -> str:
    """The SHA-256 of all but the summary, which follows from it."""
    return hashlib.sha256(multiverse.model_dump_json().encode()).hexdigest()
