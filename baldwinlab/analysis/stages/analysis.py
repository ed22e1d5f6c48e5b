"""Analysis of the stages of a paper: comparisons with controls, and the specification curve.

A learning rule is compared with noise controls, which have no useful learning (evo+motor-noise),
and with matched controls of the same rule (evo+crbp+yoked). The value of a run is the mean fitness
of the last generation on unseen maps.

References
----------
Specification curve: U. Simonsohn, J. P. Simmons and L. D. Nelson, Specification curve analysis,
2020.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import nan
from typing import Any, Final, NamedTuple

import numpy as np
from scipy import stats

from baldwinlab.analysis.claim_results import ClaimResult
from baldwinlab.analysis.results.numbers import replace_undefined
from baldwinlab.analysis.statistics import Comparison, compare, median_interval
from baldwinlab.analysis.statistics.bootstrap import Sample
from baldwinlab.analysis.statistics.intervals import Hurdle, measure_hurdle
from baldwinlab.analysis.statistics.significance import q_values
from baldwinlab.experiment.conditions import Factors

MATCHED_KINDS: Final = ("yoked", "drift")
TAKEOFF_FITNESS: Final = 1.0
"""A run takes off if its average agent eats more than this number of items on unseen maps."""


class ControlEffect(NamedTuple):
    """Comparison of a learner with a control on the same map."""

    control: str  # Name of the control condition, with its map.
    numbers: Comparison
    p: float  # Uncorrected. For noise controls, the largest p-value of all noise controls.
    # p, corrected by the method of Benjamini and Hochberg for all learners and maps.
    q: float = nan


@dataclass(frozen=True)
class NoiseComparison:
    """The values of a learner on a map, compared with controls."""

    condition: str
    learner: str
    map: str
    # The tuned setting and its value, such as "rate 0.03", or "".
    setting: str
    values: Sample  # Fitness on unseen maps [run].
    # 95 % interval of the median over runs.
    low: float
    high: float
    hurdle: Hurdle  # The runs that take off.
    # Comparison with the noise control that has the largest median.
    noise: ControlEffect | None
    # Comparisons with the matched controls, by kind.
    matched: Mapping[str, ControlEffect]
    # Verdict of the claim that the learner eats more than each noise control, or "".
    verdict: str
    # Whether less than 90 % of the bootstrap samples of the runs have the same verdict.
    is_unstable: bool

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
        row["unstable"] = self.is_unstable
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
    """Compare each learner with the noise controls and the matched controls on the same map.

    `values`: fitness on unseen maps [run] by condition, without conditions that have no value.
    `noise_controls`: learners, for example "evo+motor-noise". Returns a row for each condition
    except the matched controls, in the order of `values`. The q-values of each kind of control are
    corrected over all rows.
    """
    # For example, evo+crbp+yoked is matched to evo+crbp.
    matched_names = {
        name for name in values if factors[name].learner.rpartition("+")[2] in MATCHED_KINDS
    }
    rows = [name for name in values if name not in matched_names]
    learners = [name for name in rows if factors[name].learner not in noise_controls]
    noise = _compare_with_best(values, factors, dict.fromkeys(learners, noise_controls))
    matched = {
        kind: _compare_with_best(
            values, factors, {name: [f"{factors[name].learner}+{kind}"] for name in rows}
        )
        for kind in MATCHED_KINDS
    }
    claims = _find_claims(results, factors, noise_controls)
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
            verdict=claims[name].label if name in claims else "",
            is_unstable=name in claims and claims[name].is_unstable,
        )
        for name in rows
        for interval in [median_interval(values[name])]  # Assigns a variable.
    ]


def _compare_with_best(
    values: Mapping[str, Sample],
    factors: Mapping[str, Factors],
    controls: Mapping[str, Sequence[str]],
) -> dict[str, ControlEffect]:
    """Compare conditions with the control of the largest median on their map, with q-values.

    `controls`: the learners of the controls, by condition. A condition without values of a control
    is left out. The question is whether the condition eats more than each control. The p-value of
    this intersection-union test is the largest p-value (R. L. Berger, Technometrics 24, 1982).
    """
    conditions = {factors[name]: name for name in values}
    effects = {}
    for name, learners in controls.items():
        candidates = [conditions.get(factors[name]._replace(learner=item)) for item in learners]
        comparisons = {
            control: compare(values[name], values[control]) for control in candidates if control
        }
        if comparisons:
            best = max(comparisons, key=lambda control: comparisons[control].median_b)
            p = max(comparison.p for comparison in comparisons.values())
            effects[name] = ControlEffect(best, comparisons[best], p)
    qs = q_values([effect.p for effect in effects.values()]).tolist()
    return {
        name: effect._replace(q=q) for (name, effect), q in zip(effects.items(), qs, strict=True)
    }


def _find_claims(
    results: Sequence[ClaimResult], factors: Mapping[str, Factors], noise_controls: Sequence[str]
) -> dict[str, ClaimResult]:
    """Return, by condition, the result of a claim that compares it with noise controls only."""
    claims = {}
    for result in results:
        conditions = {finding.comparison.a for finding in result.findings}
        references = {finding.comparison.b for finding in result.findings}
        are_noise = all(
            name in factors and factors[name].learner in noise_controls for name in references
        )
        if len(conditions) == 1 and references and are_noise:
            claims[conditions.pop()] = result
    return claims


class RankAgreement(NamedTuple):
    """Rank orders of several judges. Here, the judges are specifications that rank learners."""

    # [judge, object]. Rank 1 has the largest value, and equal values have their mean rank.
    ranks: Sample
    # Kendall's W, corrected for ties: 0 for no agreement, 1 for equal rank orders. NaN without two
    # judges and two objects, or if all values of each judge are equal.
    w: float
    p: float  # p-value of no agreement, by the chi-squared approximation.


def measure_agreement(values: Sample) -> RankAgreement:
    """Rank the objects of each judge in values [judge, object], and measure the agreement."""
    ranks = stats.rankdata(-values, axis=1)
    n_judges, n_objects = ranks.shape
    sums = ranks.sum(axis=0)
    ties = sum(_count_ties(row) for row in ranks)
    largest = n_judges**2 * (n_objects**3 - n_objects) - n_judges * ties  # Divisor of W.
    if n_judges < 2 or largest == 0:
        return RankAgreement(ranks, np.nan, np.nan)
    w = 12 * float(((sums - sums.mean()) ** 2).sum()) / largest
    p = float(stats.chi2.sf(n_judges * (n_objects - 1) * w, n_objects - 1))
    return RankAgreement(ranks, w, p)


def _count_ties(ranks: Sample) -> float:
    """Return the sum of t^3 - t over the groups of t equal ranks."""
    _, sizes = np.unique(ranks, return_counts=True)
    return float((sizes**3 - sizes).sum())


class LearnerRanks(NamedTuple):
    """A learner in all specifications."""

    learner: str
    ranks: Sample  # Rank in each specification, [specification]; rank 1 has the largest fitness.
    effects: Sample  # Difference to the best noise control of the specification, [specification].

    @property
    def median_rank(self) -> float:
        """The median rank over specifications."""
        return float(np.median(self.ranks))

    @property
    def share_above_noise(self) -> float:
        """The share of specifications with more than the best noise control."""
        return float(np.mean(self.effects > 0))

    def record(self) -> dict[str, Any]:
        """Return the learner for JSON and CSV."""
        return {
            "learner": self.learner,
            "specifications": self.ranks.size,
            "median_rank": self.median_rank,
            "lowest_rank": float(self.ranks.min()),
            "highest_rank": float(self.ranks.max()),
            "median_effect": float(np.median(self.effects)),
            "share_above_noise": self.share_above_noise,
        }


class SettingRanks(NamedTuple):
    """The specifications that share the value of one setting."""

    field: str
    value: str
    n_specifications: int
    ranks: Mapping[str, float]  # Median rank by learner, the best learner first.

    @property
    def best(self) -> str:
        """The learner with the best median rank."""
        return next(iter(self.ranks))


class SpecificationResults(NamedTuple):
    """Learners in all specifications, sorted by median rank."""

    learners: list[LearnerRanks]  # The learners and the noise controls.
    specifications: list[str]
    w: float  # Kendall's W of the rank orders.
    p: float

    def rank_by_setting(self, settings: Mapping[str, Mapping[str, str]]) -> list[SettingRanks]:
        """Return the median ranks for each value of each setting.

        `settings`: values by specification and field, {"s01": {"learning.rate": "0.1"}}.
        """
        groups = []
        for field in settings[self.specifications[0]]:
            values = np.array([settings[name][field] for name in self.specifications])
            for value in dict.fromkeys(values.tolist()):
                ranks = {
                    row.learner: float(np.median(row.ranks[values == value]))
                    for row in self.learners
                }
                sorted_ranks = dict(sorted(ranks.items(), key=lambda item: item[1]))
                groups.append(
                    SettingRanks(field, value, int((values == value).sum()), sorted_ranks)
                )
        return groups


def evaluate_specifications(
    values: Mapping[str, Sample], factors: Mapping[str, Factors], noise_controls: Sequence[str]
) -> SpecificationResults | None:
    """Rank the learners in each specification by the mean fitness on unseen maps.

    A specification is a combination of settings, stored as `Factors.variant`. `values`: fitness
    [run] by condition. Specifications without all conditions are left out. None if none is left.
    """
    learners = list(dict.fromkeys(factor.learner for factor in factors.values()))
    maps = dict.fromkeys(factor.map for factor in factors.values())
    conditions = {factor[:3]: name for name, factor in factors.items()}
    means: dict[str, list[float]] = {}
    for variant in dict.fromkeys(factor.variant for factor in factors.values()):
        names = [
            [conditions[learner, map_name, variant] for map_name in maps] for learner in learners
        ]
        if all(name in values for group in names for name in group):
            means[variant] = [
                float(np.mean([values[name].mean() for name in group])) for group in names
            ]
    if not means:
        return None
    # [specification, learner]
    table = np.array(list(means.values()))
    agreement = measure_agreement(table)
    is_noise = np.array([learner in noise_controls for learner in learners])
    effects = table - table[:, is_noise].max(axis=1, keepdims=True)
    rows = [
        LearnerRanks(learner, agreement.ranks[:, index], effects[:, index])
        for index, learner in enumerate(learners)
    ]
    rows.sort(key=lambda row: row.median_rank)
    return SpecificationResults(rows, list(means), agreement.w, agreement.p)
