"""Records of a multiverse: the outcomes of all claims under all variants of a paper."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict

from baldwinlab.analysis.results.verdicts import Verdict


class _Record(BaseModel):
    model_config = ConfigDict(frozen=True, allow_inf_nan=False)


class Outcome(_Record):
    """The verdict on a claim, and the deciding comparison. A missing number is None."""

    verdict: Verdict
    condition: str | None = None
    comparison: str | None = None
    measure: str | None = None
    effect: float | None = None
    interval: tuple[float, float] | None = None
    p_holm: float | None = None
    a12: float | None = None


class ClaimText(_Record):
    """A claim of the paper."""

    id: str
    title: str
    claim: str
    # Effect size in the paper, in items per agent, or None.
    figure: float | None
    # Whether the claim was restated after results were known. Its verdicts are not counted.
    is_exploratory: bool = False


class VariantResult(_Record):
    """A variant of the paper with the outcomes of all claims."""

    name: str
    description: str
    # The changed alternatives, for example {"R2": "contact-5"}. Empty for the standard variant.
    choices: dict[str, str]
    # The changed settings, by path, such as {"contact.reach": 5}.
    fields: dict[str, Any]
    # Smallest and largest number of runs of a condition.
    runs: tuple[int, int]
    # Number of claims that hold, without exploratory claims.
    held: int
    # Distance from the paper, or None if it is undefined.
    distance: float | None
    # Outcomes by claim.
    outcomes: dict[str, Outcome]


class Multiverse(_Record):
    """All variants of a paper with the outcomes of its claims."""

    seed: int
    # Number of final generations that are averaged in each run.
    last: int
    claims: tuple[ClaimText, ...]
    variants: tuple[VariantResult, ...]
    # Authors, title and publication of the paper.
    source: str = ""

    @property
    def singles(self) -> Multiverse:
        """The standard variant, and the variants that change a single choice."""
        variants = tuple(variant for variant in self.variants if len(variant.choices) < 2)
        return self.model_copy(update={"variants": variants})

    @property
    def has_combinations(self) -> bool:
        """Whether a variant changes several choices."""
        return len(self.singles.variants) < len(self.variants)

    @property
    def n_counted_claims(self) -> int:
        """The number of claims without exploratory claims."""
        return sum(not claim.is_exploratory for claim in self.claims)

    @property
    def choices(self) -> list[str]:
        """The open choices, by name."""
        return sorted({choice for variant in self.variants for choice in variant.choices})
