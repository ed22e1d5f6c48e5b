"""Number of runs with which the signed-rank test would detect the observed effect.

References
----------
E. L. Lehmann, Nonparametrics: Statistical Methods Based on Ranks (1975), section 4.2.
"""

from __future__ import annotations

from math import ceil, log2, sqrt

import numpy as np
from scipy import stats

from baldwinlab.analysis.statistics.samples import Sample

# Probability that a study of the required size detects the effect.
POWER = 0.8
# Larger numbers of runs are not realistic.
MAX_RUNS = 10_000


def signed_rank_runs(differences: Sample, level: float) -> int | None:
    """Compute the number of runs that detects the observed effect with a probability of 80 %.

    Parameters
    ----------
    differences
        Finite differences, [pair], at least two.
    level
        Two-sided level of the test, corrected for the other tests.

    Returns
    -------
    int or None
        The number of runs, at least the smallest number with which the test can be significant.
        None if more than `MAX_RUNS` runs are needed.
    """
    sums = differences[:, None] + differences
    # By run: probability that the sum with another difference is above 0. A tie counts half.
    is_above = np.where(sums == 0, 0.5, sums > 0)
    np.fill_diagonal(is_above, 0.0)
    probabilities = is_above.sum(axis=1) / (differences.size - 1)
    distance = abs(float(probabilities.mean()) - 0.5)
    if distance == 0:
        return None
    # Standard deviations for one run, without an effect and with the observed effect.
    null_deviation = 1 / sqrt(3)
    deviation = 2 * float(probabilities.std())
    quantiles = float(stats.norm.isf(level / 2)), float(stats.norm.ppf(POWER))
    runs = ceil(((quantiles[0] * null_deviation + quantiles[1] * deviation) / distance) ** 2)
    # The smallest p-value of n runs is 2 ** (1 - n).
    smallest = int(1 - log2(level)) + 1
    required = max(runs, smallest)
    return required if required <= MAX_RUNS else None
