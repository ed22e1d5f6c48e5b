"""Results of claims, which `claims.py` computes: findings of comparisons, and verdicts of claims.

A claim of a paper has one or more comparisons. A finding is a comparison with its result.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import nan
from typing import Any

from baldwinlab.analysis import statistics
from baldwinlab.analysis.results.numbers import finite_or_none, replace_undefined
from baldwinlab.analysis.results.verdicts import (
    TOO_FEW_RUNS,
    UNDECIDED,
    VERDICTS,
    FamilyTest,
    Verdict,
    combine_verdicts,
    has_enough_runs,
)
from baldwinlab.analysis.statistics.comparisons import MIN_STABILITY
from baldwinlab.analysis.statistics.significance import (
    MIN_INTERVAL_RUNS,
    describe_required_runs,
    interval_runs,
)
from baldwinlab.papers.claims import Claim, ClaimComparison
from baldwinlab.papers.rules import RULES, Rule


@dataclass(frozen=True)
class Finding:
    """A comparison of a claim, with the measured numbers and the verdict. NaN is undefined."""

    comparison: ClaimComparison
    numbers: statistics.Comparison
    verdict: Verdict
    # Meaning of the measure if a model defines it, else "".
    meaning: str = ""
    # The test, with a p-value corrected for all comparisons of the claims. None without a p-value.
    test: FamilyTest | None = None
    # Fraction of bootstrap samples of runs with the same verdict. NaN without a rank test.
    stability: float = nan
    # Number of stored runs that are not used, by condition. Only numbers above 0 are listed.
    unused_runs: Mapping[str, int] = field(default_factory=dict)

    @property
    def rule(self) -> Rule:
        return RULES[self.comparison.rule]

    @property
    def deciding_test(self) -> FamilyTest | None:
        """The test if the rule decides by a p-value, else None."""
        return self.test if self.rule.kind in ("direction", "survival") else None

    @property
    def p_holm(self) -> float:
        """The corrected p-value, or NaN without a test."""
        return self.test.p_holm if self.test else nan

    @property
    def is_unstable(self) -> bool:
        """Whether less than `MIN_STABILITY` of the bootstrap samples have the verdict.

        False without a rank test (NaN), and for too few runs, because the label shows these.
        """
        return self.stability < MIN_STABILITY and not self.has_too_few_runs

    @property
    def has_too_few_runs(self) -> bool:
        """Whether too few runs are the reason why the comparison is undecided."""
        if self.verdict != UNDECIDED:
            return False
        if self.deciding_test:
            return self.deciding_test.has_too_few_runs
        return self.rule.kind == "interval" and not has_enough_runs(self.numbers)

    @property
    def label(self) -> str:
        """The verdict as a report shows it, for example "holds" or "too few runs"."""
        return TOO_FEW_RUNS if self.has_too_few_runs else self.verdict

    @property
    def required_runs(self) -> int | None:
        """The number of runs that would decide the comparison if the effect is the observed one.

        None if the comparison is decided, or if no realistic number of runs would decide it.
        """
        if self.verdict != UNDECIDED:
            return None
        if self.deciding_test:
            return self.deciding_test.required_runs
        if self.rule.contains_limits:
            return MIN_INTERVAL_RUNS
        if self.rule.kind == "interval":
            return interval_runs(self.numbers, self.rule.limits(self.comparison.bound))
        return None

    @property
    def explanation(self) -> str:
        """Phrases: why the corrected p-value decides, and how many runs would decide. Can be ""."""
        is_decided = self.verdict != UNDECIDED
        if self.deciding_test:
            low, high = self.numbers.low, self.numbers.high
            return self.deciding_test.explain(low, high, is_decided=is_decided)
        if is_decided:
            return ""
        minimum = f"an interval needs {MIN_INTERVAL_RUNS} runs" if self.has_too_few_runs else ""
        return _join_notes([minimum, describe_required_runs(self.required_runs)])

    @property
    def note(self) -> str:
        """The phrases of `explanation` and of `describe_unused_runs`, joined by semicolons."""
        return _join_notes([self.explanation, self.describe_unused_runs()])

    def describe_unused_runs(self) -> str:
        """Return a phrase such as "2 of 30 runs of evo/A have no value", or ""."""
        n_used = {self.comparison.b: self.numbers.n_b, self.comparison.a: self.numbers.n_a}
        parts = [
            f"{n_unused} of {n_unused + n_used[condition]} runs of {condition}"
            for condition, n_unused in self.unused_runs.items()
        ]
        verb = "has" if sum(self.unused_runs.values()) == 1 else "have"
        return f"{' and '.join(parts)} {verb} no value" if parts else ""

    def record(self) -> dict[str, Any]:
        """Return the finding for JSON, with None for undefined numbers."""
        numbers = replace_undefined(self.numbers._asdict())
        low = numbers.pop("low")
        high = numbers.pop("high")
        comparison = self.comparison
        return {
            "condition": comparison.a,
            "comparison": comparison.reference,
            "measure": comparison.measure,
            # All fields of `statistics.Comparison` but the ends of the interval.
            **numbers,
            "interval": None if low is None else [low, high],
            "p_holm": finite_or_none(self.p_holm),
            "verdict": self.verdict,
            "smallest_p_holm": self.test.smallest_p_holm if self.test else None,
            "too_few_runs": self.has_too_few_runs,
            "required_runs": self.required_runs,
            "stability": finite_or_none(self.stability),
            "unused_runs": dict(self.unused_runs),
            "note": self.note,
        }


def _join_notes(notes: Sequence[str]) -> str:
    """Join distinct notes that are not empty."""
    return "; ".join(note for note in dict.fromkeys(notes) if note)


def rank_weakness(finding: Finding) -> tuple[int, float]:
    """Return a sort key that is largest for the weakest finding. An undefined p-value is 0."""
    p = finding.p_holm if math.isfinite(finding.p_holm) else 0.0
    return VERDICTS.index(finding.verdict), p


@dataclass(frozen=True)
class ClaimResult:
    """A claim with its verdict and its findings."""

    claim: Claim
    findings: tuple[Finding, ...]
    # Conditions without a run.
    missing: tuple[str, ...]
    # Measures of models that are not loaded.
    unmeasured: tuple[str, ...] = ()
    # Assays that are not stored.
    unassayed: tuple[str, ...] = ()

    @property
    def verdict(self) -> Verdict:
        """The verdict over all comparisons of the claim."""
        return combine_verdicts([finding.verdict for finding in self.findings])

    @property
    def has_too_few_runs(self) -> bool:
        """Whether too few runs are the reason why the claim is undecided."""
        return self.verdict == UNDECIDED and any(
            finding.has_too_few_runs for finding in self.findings
        )

    @property
    def label(self) -> str:
        """The verdict as a report shows it, for example "holds" or "too few runs"."""
        return TOO_FEW_RUNS if self.has_too_few_runs else self.verdict

    @property
    def is_unstable(self) -> bool:
        """Whether a comparison that decides the claim is unstable."""
        return any(
            finding.is_unstable for finding in self.findings if finding.verdict == self.verdict
        )

    @property
    def why_not(self) -> str:
        """The reason why the claim is not evaluated, or "" if it is evaluated."""
        if self.missing:
            return f"no run of {', '.join(self.missing)}"
        if self.unmeasured:
            names = ", ".join(map(repr, self.unmeasured))
            return f"{names} needs a model that is not loaded: pass its file with --part FILE"
        if self.unassayed:
            command = f"baldwinlab assay . --assays {' '.join(self.unassayed)}"
            names = ", ".join(self.unassayed)
            return f"the assay {names} is not stored: in the study's directory, run `{command}`"
        return ""

    @property
    def deciding(self) -> Finding | None:
        """The weakest finding: worst verdict, then largest p-value. None without findings."""
        return max(self.findings, key=rank_weakness, default=None)

    @property
    def note(self) -> str:
        """The explanation of the deciding finding, and the unused runs of all findings."""
        if self.deciding is None:
            return ""
        unused = [finding.describe_unused_runs() for finding in self.findings]
        return _join_notes([self.deciding.explanation, *unused])

    @property
    def difference_from_paper(self) -> float | None:
        """The effect of the deciding finding minus the value in the paper, None if unknown."""
        paper_value = self.claim.paper_value
        if self.deciding is None or paper_value is None:
            return None
        effect = self.deciding.numbers.effect
        return None if math.isnan(effect) else effect - paper_value

    @property
    def agrees_with_paper(self) -> bool:
        """Whether the interval of the deciding finding contains the value in the paper.

        True if the paper has no value. Without an interval, the effect must equal the value.
        """
        difference, paper_value = self.difference_from_paper, self.claim.paper_value
        if difference is None or self.deciding is None or paper_value is None:
            return True
        numbers = self.deciding.numbers
        if math.isnan(numbers.low):
            return difference == 0
        return numbers.low <= paper_value <= numbers.high

    def record(self) -> dict[str, Any]:
        """Return the claim for JSON: numbers of the deciding finding or None, and all findings."""
        deciding: dict[str, Any] = self.deciding.record() if self.deciding else {}
        # a12 is the effect size of Vargha and Delaney.
        columns = ("condition", "comparison", "measure", "effect", "interval", "p", "p_holm", "a12")
        claim = self.claim
        return {
            "id": claim.id,
            "kind": claim.kind,
            "claim": claim.text,
            **{name: deciding.get(name) for name in columns},
            "note": self.note,
            "verdict": self.verdict,
            "too_few_runs": self.has_too_few_runs,
            "unstable": self.is_unstable,
            "rule": claim.rule,
            "paper": claim.paper,
            "figure": claim.paper_value,
            "from_figure": self.difference_from_paper,
            "missing": list(self.missing),
            "why_not": self.why_not,
            "comparisons": [finding.record() for finding in self.findings],
        }
