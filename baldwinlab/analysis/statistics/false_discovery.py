"""Control of the false discovery rate over a table of tests.

References
----------
Y. Benjamini and Y. Hochberg, Journal of the Royal Statistical Society B 57 (1995).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import stats

from baldwinlab.analysis.statistics.rules import SIGNIFICANCE_LEVEL
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
        # Rank k is possible if k - 1 of the remaining tests have p-values below its limit. The
        # products are those of `q_values`: a p-value that equals a limit is rounded the same way.
        possible = np.flatnonzero(remaining * (ps.size / ranks[1:]) < SIGNIFICANCE_LEVEL)
        rank = ranks[possible[-1] + 1] if possible.size else 1
        criticals[index] = SIGNIFICANCE_LEVEL * rank / ps.size
    return criticals
