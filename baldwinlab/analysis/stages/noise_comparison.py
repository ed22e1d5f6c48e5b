"""Comparison of learning rules with noise controls and with their matched controls.

The value of a run is the mean fitness of its last generation on unseen maps.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import nan
from typing import Any, Final, NamedTuple

import numpy as np

from baldwinlab.analysis.claim_results import ClaimResult
from baldwinlab.analysis.statistics import Comparison, compare, median_interval
from baldwinlab.analysis.statistics.csv import replace_undefined
from baldwinlab.analysis.statistics.false_discovery import q_values
from baldwinlab.analysis.statistics.proportions import Hurdle, measure_hurdle
from baldwinlab.analysis.statistics.samples import Sample
from baldwinlab.experiment.conditions import Factors

MATCHED_KINDS: Final = ("yoked", "drift")
TAKEOFF_FITNESS: Final = 1.0
"""A run takes off if its average agent eats more than this number of items on unseen maps."""


class ControlEffect(NamedTuple):
    """Comparison of a learner with a control on the same map."""

    control: str  # Name of the control condition, with its map.
    numbers: Comparison
    p: float  # The p-value of the table: for noise controls, the largest of all noise controls.
    # `p`, corrected by the method of Benjamini and Hochberg for all learners and maps.
    q: float = nan


@dataclass(frozen=True)
class NoiseComparison:
    """A learner on a map."""

    condition: str
    learner: str
    map: str
    # The tuned setting and its value, such as "rate 0.03", or "".
    setting: str
    values: Sample
    low: float
    high: float
    hurdle: Hurdle
    # Comparison with the noise control that has the largest median.
    noise: ControlEffect | None
    # Comparisons with the matched controls, by kind.
    matched: Mapping[str, ControlEffect]
    # Verdict of the claim that the learner has more than each noise control, or "".
    verdict: str

    @property
    def median(self) -> float:
        """The median over runs."""
        return float(np.median(self.values))

    def record(self) -> dict[str, Any]:
        """Return the row for JSON and CSV, with None for undefined numbers."""
        row: dict[str, Any] = {
            "learner": self.learner,
            "map": self.map,
            "setting": self.setting,
            "runs": self.values.size,
            "median": self.median,
            "low": self.low,
            "high": self.high,
            "takeoffs": self.hurdle.takeoffs,
            "takeoff_share_low": self.hurdle.share_low,
            "takeoff_share_high": self.hurdle.share_high,
            "size_of_takeoffs": self.hurdle.size,
        }
        effects = {"noise": self.noise, **{kind: self.matched.get(kind) for kind in MATCHED_KINDS}}
        for name, effect in effects.items():
            row |= _make_effect_record(name, effect)
        row["verdict"] = self.verdict
        return replace_undefined(row)


def _make_effect_record(name: str, effect: ControlEffect | None) -> dict[str, Any]:
    numbers = effect.numbers if effect else None
    return {
        f"{name}_control": effect.control if effect else None,
        f"{name}_effect": numbers.effect if numbers else None,
        f"{name}_low": numbers.low if numbers else None,
        f"{name}_high": numbers.high if numbers else None,
        f"{name}_p": effect.p if effect else None,
        f"{name}_q": effect.q if effect else None,
    }


def compare_with_noise(
    values: Mapping[str, Sample],
    factors: Mapping[str, Factors],
    noise_controls: Sequence[str],
    settings: Mapping[str, str],
    results: Sequence[ClaimResult] = (),
) -> list[NoiseComparison]:
    """Compare each learner with the noise controls of its map, and with its matched controls.

    `values`: fitness on unseen maps [run] by condition, without conditions that have no value.
    `noise_controls`: names of the noise controls, without their maps. Returns a row for each
    condition except the matched controls, in the order of the conditions. The correction of the
    q-values is for all rows, separately for each kind of control.
    """
    conditions = {factors[name]: name for name in values}
    matched_names = {
        name for name in values if factors[name].learner.rpartition("+")[2] in MATCHED_KINDS
    }
    rows = [name for name in values if name not in matched_names]
    noise = _correct(
        {
            name: _compare_with_best(name, values, conditions, factors, noise_controls)
            for name in rows
        }
    )
    matched = {
        kind: _correct(
            {name: _compare_with_matched(name, kind, values, conditions, factors) for name in rows}
        )
        for kind in MATCHED_KINDS
    }
    verdicts = _find_verdicts(results, factors, noise_controls)
    return [
        NoiseComparison(
            condition=name,
            learner=factors[name].learner,
            map=factors[name].map,
            setting=settings.get(name, ""),
            values=values[name],
            low=interval[0],
            high=interval[1],
            hurdle=measure_hurdle(values[name], TAKEOFF_FITNESS),
            noise=noise.get(name),
            matched={kind: effects[name] for kind, effects in matched.items() if name in effects},
            verdict=verdicts.get(name, ""),
        )
        for name in rows
        for interval in [median_interval(values[name])]
    ]


def _compare_with_best(
    name: str,
    values: Mapping[str, Sample],
    conditions: Mapping[Factors, str],
    factors: Mapping[str, Factors],
    noise_controls: Iterable[str],
) -> ControlEffect | None:
    """Compare a learner with the noise control of the largest median.

    A learner has more than the best noise control if it has more than each. The p-value of this
    intersection-union test is the largest p-value (R. L. Berger, Technometrics 24, 1982).
    """
    learner = factors[name]
    if learner.learner in noise_controls:
        return None
    candidates = [conditions.get(learner._replace(learner=control)) for control in noise_controls]
    comparisons = {
        control: compare(values[name], values[control]) for control in candidates if control
    }
    if not comparisons:
        return None
    best = max(comparisons, key=lambda control: comparisons[control].median_b)
    p = max(comparison.p for comparison in comparisons.values())
    return ControlEffect(best, comparisons[best], p)


def _compare_with_matched(
    name: str,
    kind: str,
    values: Mapping[str, Sample],
    conditions: Mapping[Factors, str],
    factors: Mapping[str, Factors],
) -> ControlEffect | None:
    learner = factors[name]
    control = conditions.get(learner._replace(learner=f"{learner.learner}+{kind}"))
    if control is None:
        return None
    numbers = compare(values[name], values[control])
    return ControlEffect(control, numbers, numbers.p)


def _correct(effects: Mapping[str, ControlEffect | None]) -> dict[str, ControlEffect]:
    """Return the effects with their q-values."""
    measured = {name: effect for name, effect in effects.items() if effect}
    qs = q_values([effect.p for effect in measured.values()]).tolist()
    return {
        name: effect._replace(q=q) for (name, effect), q in zip(measured.items(), qs, strict=True)
    }


def _find_verdicts(
    results: Sequence[ClaimResult], factors: Mapping[str, Factors], noise_controls: Sequence[str]
) -> dict[str, str]:
    """Return the verdict of the claim that compares a condition with noise controls only."""
    verdicts = {}
    for result in results:
        conditions = {finding.comparison.a for finding in result.findings}
        references = {finding.comparison.b for finding in result.findings}
        are_noise = all(
            name in factors and factors[name].learner in noise_controls for name in references
        )
        if len(conditions) == 1 and references and are_noise:
            verdicts[conditions.pop()] = result.label
    return verdicts
