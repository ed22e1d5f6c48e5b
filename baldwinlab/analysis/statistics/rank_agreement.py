"""Agreement of rank orders: Kendall's coefficient of concordance W.

References
----------
M. G. Kendall and B. Babington Smith, Annals of Mathematical Statistics 10 (1939).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import stats

from baldwinlab.analysis.statistics.samples import Sample


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
