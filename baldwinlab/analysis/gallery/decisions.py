"""Decide the questions of all systems: effect size, interval, q-value, verdict and stability.

The questions of all systems are one table. Two families of tests are corrected over the table by
the method of Benjamini and Hochberg: the tests for a difference, and the tests for equivalence.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import nan
from typing import Any, Final, Literal, NamedTuple

import numpy as np

from baldwinlab.analysis.estimands.questions import MEASURED, Estimate
from baldwinlab.analysis.results.numbers import finite_or_none
from baldwinlab.analysis.results.verdicts import EQUIVALENT, OPPOSITE, TOO_FEW_RUNS, UNDECIDED, YES
from baldwinlab.analysis.statistics.bootstrap import Sample, resample_medians
from baldwinlab.analysis.statistics.comparisons import MIN_STABILITY, verdict_stability
from baldwinlab.analysis.statistics.hypothesis_tests import equivalence_p, sign_interval, sign_test
from baldwinlab.analysis.statistics.intervals import Hurdle, measure_hurdle
from baldwinlab.analysis.statistics.significance import (
    SIGNIFICANCE_LEVEL,
    critical_p_values,
    describe_too_few,
    plan_paired_test,
    q_values,
    sign_test_runs,
    smallest_corrected_p,
)

Verdict = Literal["yes", "opposite", "equivalent", "undecided"]
VERDICTS: Final = (YES, OPPOSITE, EQUIVALENT, UNDECIDED)
COLUMNS: Final = (
    "paper", "condition", "question", "class", "trait", "estimate", "low", "high", "p", "q",
    "verdict", "stability", "runs", "learner", "control", "neutral",
)  # fmt: skip
"""The keys of a row of gallery.json and the columns of gallery.csv."""


class SystemName(NamedTuple):
    """A condition that evolves and learns."""

    paper: str
    condition: str


@dataclass(frozen=True)
class Measurement:
    """The numbers and the verdict of a question that is measured."""

    effect: float  # Median over runs. 0 means no effect.
    # 95 % interval of the median over runs, by the sign test; NaN below six runs.
    low: float
    high: float
    standard_error: float  # Standard deviation of the bootstrap medians.
    p: float  # p-value of the two-sided sign test.
    q: float  # p-value, corrected for all tests of the table.
    verdict: Verdict  # One of `VERDICTS`.
    stability: float  # Share of bootstrap samples of runs with the same verdict.
    runs: int
    # For an undecided question, the number of runs that shows a difference or equivalence with a
    # probability of 80 % if the effect is the observed one. None if the question is decided, or if
    # no realistic number of runs decides it.
    required_runs: int | None
    hurdle: Hurdle  # The runs above the equivalence bound, and their effect.
    has_too_few_runs: bool  # Whether no values of so few runs could be significant.

    @property
    def label(self) -> str:
        """The verdict, or "too few runs" instead of "undecided"."""
        has_reason = self.verdict == UNDECIDED and self.has_too_few_runs
        return TOO_FEW_RUNS if has_reason else self.verdict

    @property
    def is_unstable(self) -> bool:
        """Whether other runs could give another verdict."""
        return self.stability < MIN_STABILITY


@dataclass(frozen=True)
class Decision:
    """The decision on a question of a system. `measurement` is None if it is not measured."""

    system: SystemName
    estimate: Estimate
    measurement: Measurement | None = None

    def row(self) -> dict[str, Any]:
        """Return the decision with the keys `COLUMNS`, with None for an undefined value."""
        measurement = self.measurement
        columns = ("low", "high", "p", "q", "stability")
        return {
            "paper": self.system.paper,
            "condition": self.system.condition,
            "question": self.estimate.question,
            "class": self.estimate.measurability,
            "trait": self.estimate.trait,
            "estimate": measurement.effect if measurement else None,
            **{name: finite_or_none(getattr(measurement, name, nan)) for name in columns[:4]},
            "verdict": measurement.verdict if measurement else None,
            "stability": measurement.stability if measurement else None,
            "runs": measurement.runs if measurement else None,
            **{name: self._find_term(name) for name in COLUMNS[-3:]},
        }

    def _find_term(self, name: str) -> float | None:
        """Return the median over runs of a term of the estimate, or None."""
        terms = self.estimate.terms
        return finite_or_none(float(terms[name].median())) if name in terms else None


class _Limits(NamedTuple):
    """Equivalence bound of one question, and the p-values below which it is decided."""

    difference: float
    equivalence: float
    bound: float


def decide(estimates: Mapping[SystemName, Sequence[Estimate]]) -> list[Decision]:
    """Decide all questions of all systems, in the order of `estimates`."""
    decisions = [
        Decision(system, entry) for system, entries in estimates.items() for entry in entries
    ]
    measured = [decision for decision in decisions if decision.estimate.measurability == MEASURED]
    samples = [_finite_values(decision.estimate) for decision in measured]
    bounds = [decision.estimate.equivalence_bound for decision in measured]
    # `values[None]` is a single sample [sample, run].
    differences = [float(sign_test(values[None])[0]) for values in samples]
    equivalences = [
        float(equivalence_p(values[None], bound)[0])
        for values, bound in zip(samples, bounds, strict=True)
    ]
    limits = map(_Limits, critical_p_values(differences), critical_p_values(equivalences), bounds)
    smallest = smallest_corrected_p([plan_paired_test(values.size) for values in samples], q_values)
    has_too_few = (smallest >= SIGNIFICANCE_LEVEL).tolist()
    qs = q_values(differences).tolist()
    numbers = zip(samples, differences, qs, limits, has_too_few, strict=True)
    # `next` takes the measurements in the order of the measured decisions.
    measurements = iter([_make_measurement(*row) for row in numbers])
    return [
        replace(decision, measurement=next(measurements))
        if decision.estimate.measurability == MEASURED
        else decision
        for decision in decisions
    ]


def describe_too_few_runs(decisions: Sequence[Decision]) -> str:
    """Describe the measured questions whose runs cannot suffice for "yes" or "opposite"."""
    tests = [plan_paired_test(row.measurement.runs) for row in decisions if row.measurement]
    return describe_too_few(tests, q_values)


def _finite_values(estimate: Estimate) -> Sample:
    """Return the values of a measured estimate in the runs that define them."""
    if estimate.values is None:
        raise ValueError(f"the measured question {estimate.question!r} has no values")
    values = np.asarray(estimate.values.values, np.float64)
    return values[np.isfinite(values)]


def _decide_samples(samples: Sample, limits: _Limits) -> list[Verdict]:
    """Return the verdict on each sample [sample, run].

    An effect within the equivalence bound is equivalent to no effect, even if it differs from 0
    significantly.
    """
    is_equivalent = equivalence_p(samples, limits.bound) < limits.equivalence
    is_different = sign_test(samples) < limits.difference
    effects = np.median(samples, axis=1)
    verdicts = np.select(
        [is_equivalent, is_different & (effects > 0), is_different & (effects < 0)],
        [EQUIVALENT, YES, OPPOSITE],
        UNDECIDED,
    )
    result: list[Verdict] = verdicts.tolist()
    return result


def _make_measurement(
    values: Sample, p: float, q: float, limits: _Limits, has_too_few_runs: bool
) -> Measurement:
    (verdict,) = _decide_samples(values[None], limits)
    low, high = sign_interval(values)
    required_runs = None
    if verdict == UNDECIDED and values.size > 1:
        required_runs = _find_required_runs(values, limits)
    return Measurement(
        effect=float(np.median(values)),
        low=low,
        high=high,
        standard_error=float(resample_medians(values).std()) if values.size > 1 else nan,
        p=p,
        q=q,
        verdict=verdict,
        stability=verdict_stability(values, verdict, partial(_decide_samples, limits=limits)),
        runs=values.size,
        required_runs=required_runs,
        hurdle=measure_hurdle(values, limits.bound),
        has_too_few_runs=has_too_few_runs,
    )


def _find_required_runs(values: Sample, limits: _Limits) -> int | None:
    """Return the smallest number of runs that shows a difference or equivalence, or None."""
    numbers = [sign_test_runs(values, limits.difference)]
    if abs(np.median(values)) < limits.bound:
        # A one-sided test has half the p-value of the two-sided test. Equivalence needs both sides.
        level = min(1.0, 2 * limits.equivalence)
        sides = [sign_test_runs(values + bound, level) for bound in (-limits.bound, limits.bound)]
        defined = [runs for runs in sides if runs is not None]
        numbers.append(max(defined) if len(defined) == len(sides) else None)
    return min((runs for runs in numbers if runs is not None), default=None)
