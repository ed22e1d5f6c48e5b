"""Control of the false discovery rate over a table of tests.

References
----------
Y. Benjamini and Y. Hochberg, Journal of the Royal Statistical Society B 57 (1995).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy import stats

from baldwinlab.analysis.statistics.sample_sizes import SIGNIFICANCE_LEVEL
from baldwinlab.analysis.statistics.samples import Sample


def q_values(p_values: Sequence[float] | Sample) -> Sample:
    """Compute the q-values of a table of tests by the method of Benjamini and Hochberg."""
    ps = np.asarray(p_values, np.float64)
    # SciPy refuses an empty table.
    return np.asarray(stats.false_discovery_control(ps)) if ps.size else ps


def critical_p_values(p_values: Sequence[float] | Sample) -> Sample:
    """Compute the p-value below which each test is significant, given all other tests.

    A test has a q-value below the level of significance exactly if its p-value is below its limit.
    """
    ps = np.asarray(p_values, np.float64)
    ranks = np.arange(1, ps.size + 1)
    criticals = np.empty_like(ps)
    for index in range(ps.size):
        remaining = np.sort(np.delete(ps, index))
        # Rank k is possible if k - 1 of the remaining tests have p-values below its limit.
        possible = np.flatnonzero(remaining * (ps.size / ranks[1:]) < SIGNIFICANCE_LEVEL)
        rank = ranks[possible[-1] + 1] if possible.size else 1
        criticals[index] = _find_limit(ps.size / rank)
    return criticals


def _find_limit(factor: float) -> float:
    """Return the smallest p-value whose product with a factor is not below the level.

    `q_values` computes the same product, so that a p-value at the limit is rounded the same way.
    """
    limit = SIGNIFICANCE_LEVEL / factor
    while limit * factor < SIGNIFICANCE_LEVEL:
        limit = math.nextafter(limit, 1)
    while (smaller := math.nextafter(limit, 0)) * factor >= SIGNIFICANCE_LEVEL:
        limit = smaller
    return limit
