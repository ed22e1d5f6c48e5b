"""Specification curve: rank of each learner, and its effect, in each combination of settings.

References
----------
U. Simonsohn, J. P. Simmons and L. D. Nelson, Specification curve analysis, 2020.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy import stats

from baldwinlab.analysis.statistics.samples import Sample
from baldwinlab.experiment.conditions import Factors


class RankAgreement(NamedTuple):
    """Rank orders of several judges.

    Attributes
    ----------
    ranks : Sample
        Rank of each object by each judge, [judge, object]. Rank 1 has the largest value, and equal
        values have their mean rank.
    w : float
        Kendall's W, corrected for ties: 0 for no agreement, 1 for equal rank orders. NaN if a judge
        or the objects are fewer than two, or if all values of each judge are equal.
    p : float
        p-value of no agreement, by the chi-squared approximation.
    """

    ranks: Sample
    w: float
    p: float


def measure_agreement(values: Sample) -> RankAgreement:
    """Rank the objects of each judge in values [judge, object], and measure the agreement."""
    ranks = stats.rankdata(-values, axis=1)
    n_judges, n_objects = ranks.shape
    sums = ranks.sum(axis=0)
    ties = sum(_count_ties(row) for row in ranks)
    largest = n_judges**2 * (n_objects**3 - n_objects) - n_judges * ties
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


class SpecificationResults(NamedTuple):
    """Learners in all specifications, sorted by median rank."""

    learners: list[LearnerRanks]  # The learners and the noise controls.
    specifications: list[str]
    w: float  # Kendall's W of the rank orders.
    p: float


def evaluate_specifications(
    values: Mapping[str, Sample], factors: Mapping[str, Factors], noise_controls: Sequence[str]
) -> SpecificationResults | None:
    """Rank the learners in each specification by their mean fitness on unseen maps.

    `values`: [run] by condition. Returns the results, over specifications that have all conditions.
    None if there is none.
    """
    learners = list(dict.fromkeys(factor.learner for factor in factors.values()))
    maps = dict.fromkeys(factor.map for factor in factors.values())
    conditions = {factor: name for name, factor in factors.items()}
    means: dict[str, list[float]] = {}
    for variant in dict.fromkeys(factor.variant for factor in factors.values()):
        names = [
            [conditions[Factors(learner, map_name, variant)] for map_name in maps]
            for learner in learners
        ]
        if all(name in values for group in names for name in group):
            means[variant] = [
                float(np.mean([values[name].mean() for name in group])) for group in names
            ]
    if not means:
        return None
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
