"""Results of claims: findings of comparisons, and verdicts of claims."""

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
    """A comparison with its verdict. Undefined numbers are NaN."""

    comparison: ClaimComparison
    numbers: statistics.Comparison
    verdict: Verdict
    # Meaning of the measure if a model defines it, else "".
    meaning: str = ""
    # The test, whose p-value is corrected for all comparisons of the claims; None without a test.
    test: FamilyTest | None = None
    # Share of bootstrap samples of runs with the same verdict, for a rule that uses a rank test.
    stability: float = nan
    # Number of stored runs without a value, by condition; only numbers above 0.
    unused_runs: Mapping[str, int] = field(default_factory=dict)

    @property
    def rule(self) -> Rule:
        return RULES[self.comparison.rule]

    @property
    def deciding_test(self) -> FamilyTest | None:
        """The test, if the rule uses its p-value."""
        return self.test if self.rule.kind in ("direction", "survival") else None

    @property
    def p_holm(self) -> float:
        """The corrected p-value, or NaN without a test."""
        return self.test.p_holm if self.test else nan

    @property
    def is_unstable(self) -> bool:
        """Whether other runs could give another verdict.

        Too few runs are a verdict of their own.
        """
        return self.stability < MIN_STABILITY and not self.has_too_few_runs

    @property
    def has_too_few_runs(self) -> bool:
        """Whether the comparison is undecided because it has too few runs."""
        if self.verdict != UNDECIDED:
            return False
        if self.deciding_test:
            return self.deciding_test.has_too_few_runs
        return self.rule.kind == "interval" and not has_enough_runs(self.numbers)

    @property
    def label(self) -> str:
        """The verdict as a report shows it."""
        return TOO_FEW_RUNS if self.has_too_few_runs else self.verdict

    @property
    def required_runs(self) -> int | None:
        """The number of runs that would decide an undecided comparison, if any.

        The effect is assumed to be the observed one.
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
        """The number that decides, if needed, and the runs that an undecided comparison needs."""
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
        """The explanation of the verdict, and the runs that are not used."""
        return _join_notes([self.explanation, self.describe_unused_runs()])

    def describe_unused_runs(self) -> str:
        """Return the number of runs that are not used, because the measure has no value."""
        n_used = {self.comparison.b: self.numbers.n_b, self.comparison.a: self.numbers.n_a}
        parts = [
            f"{n_unused} of {n_unused + n_used[condition]} runs of {condition}"
            for condition, n_unused in self.unused_runs.items()
        ]
        verb = "has" if sum(self.unused_runs.values()) == 1 else "have"
        return f"{' and '.join(parts)} {verb} no value" if parts else ""

    def record(self) -> dict[str, Any]:
        """Return the finding for JSON, with null for undefined numbers."""
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


def _rank_weakness(finding: Finding) -> tuple[int, float]:
    """Return the order of a finding by verdict and p-value. The weakest finding is the last."""
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
        """Whether the claim is undecided because it has too few runs."""
        return self.verdict == UNDECIDED and any(
            finding.has_too_few_runs for finding in self.findings
        )

    @property
    def label(self) -> str:
        """The verdict as a report shows it."""
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
            names = ", ".join(self.unassayed)
            return f"the assay {names} is not stored: run `baldwinlab assay DIR --assays {names}`"
        return ""

    @property
    def deciding(self) -> Finding | None:
        """The weakest finding: the worst verdict, and among equal verdicts the largest p."""
        return max(self.findings, key=_rank_weakness, default=None)

    @property
    def note(self) -> str:
        """The note of the deciding comparison, and the runs that other comparisons do not use."""
        if self.deciding is None:
            return ""
        unused = [finding.describe_unused_runs() for finding in self.findings]
        return _join_notes([self.deciding.explanation, *unused])

    @property
    def difference_from_paper(self) -> float | None:
        """The deciding effect minus the value in the paper, or None if one is unknown."""
        paper_value = self.claim.paper_value
        if self.deciding is None or paper_value is None:
            return None
        effect = self.deciding.numbers.effect
        return None if math.isnan(effect) else effect - paper_value

    @property
    def agrees_with_paper(self) -> bool:
        """Whether the value of the paper, if it has one, is inside the measured interval.

        Without an interval, the two values must be equal.
        """
        difference, paper_value = self.difference_from_paper, self.claim.paper_value
        if difference is None or self.deciding is None or paper_value is None:
            return True
        numbers = self.deciding.numbers
        if math.isnan(numbers.low):
            return difference == 0
        return numbers.low <= paper_value <= numbers.high

    def record(self) -> dict[str, Any]:
        """Return the claim for JSON, with the numbers of the deciding comparison."""
        deciding: dict[str, Any] = self.deciding.record() if self.deciding else {}
        # a12 is the effect size of Vargha and Delaney.
        columns = (
            "condition",
            "comparison",
            "measure",
            "effect",
            "interval",
            "p",
            "p_holm",
            "a12",
        )
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
