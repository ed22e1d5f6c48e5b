"""Stability of a verdict: the share of bootstrap samples of runs with the same verdict.

References
----------
B. Efron and R. Tibshirani, Introduction to the Bootstrap (1993), chapter 6.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from baldwinlab.analysis.statistics.bootstrap import SEED
from baldwinlab.analysis.statistics.samples import Sample

# A verdict with a smaller share of bootstrap samples is unstable.
MIN_STABILITY = 0.9
RESAMPLES = 500


def verdict_stability(
    values: Sample, verdict: str, decide: Callable[[Sample], Sequence[str]]
) -> float:
    """Compute the share of bootstrap samples of runs with the same verdict.

    Parameters
    ----------
    values
        Finite values, [run], at least one.
    verdict
        Verdict on the values.
    decide
        Function that returns the verdict on each sample of values [sample, run].

    Returns
    -------
    float
        The share, 0 to 1.
    """
    generator = np.random.default_rng(SEED)
    indices = generator.integers(0, values.size, (RESAMPLES, values.size))
    return list(decide(values[indices])).count(verdict) / RESAMPLES
