"""Stability of a verdict: the share of bootstrap samples of runs with the same verdict.

References
----------
B. Efron and R. Tibshirani, Introduction to the Bootstrap (1993), chapter 6.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy import stats

from baldwinlab.analysis.statistics.bootstrap import SEED
from baldwinlab.analysis.statistics.rank_tests import signed_rank_tails
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


def direction_stability(
    a: Sample, b: Sample, direction: int, level: float, *, is_paired: bool
) -> float:
    """Compute the share of bootstrap samples of runs with the same direction of a rank test.

    The verdict of a bootstrap sample follows `rules.direction`. The p-values of the Mann-Whitney
    test are those of the normal approximation.

    Parameters
    ----------
    a, b
        Finite values, [run], at least one each.
    direction
        Direction of the significant difference of a and b, as `rules.direction` returns it; 0 for
        no significant difference.
    level
        Level of significance of the uncorrected p-value.
    is_paired
        Whether `a[i]` and `b[i]` are a pair, and the test is the signed-rank test. Otherwise it is
        the Mann-Whitney test.

    Returns
    -------
    float
        The share, 0 to 1.
    """
    generator = np.random.default_rng(SEED)
    indices = generator.integers(0, a.size, (RESAMPLES, a.size))
    if is_paired:
        differences = (a - b)[indices]
        effects = np.median(differences, axis=1)
        p = 2 * np.minimum(*signed_rank_tails(differences))
        # Ties count half.
        a12 = 0.5 + np.sign(differences).mean(axis=1) / 2
    else:
        samples_a = a[indices]
        samples_b = b[generator.integers(0, b.size, (RESAMPLES, b.size))]
        effects = np.median(samples_a, axis=1) - np.median(samples_b, axis=1)
        # SciPy divides by 0 if all values are equal. Such a sample has no significant difference.
        with np.errstate(invalid="ignore", divide="ignore"):
            test = stats.mannwhitneyu(samples_a, samples_b, axis=1, method="asymptotic")
        p = np.asarray(test.pvalue)
        a12 = test.statistic / (a.size * b.size)
    is_significant = (p < level) & (np.sign(effects) == np.sign(a12 - 0.5))
    directions = np.where(is_significant, np.sign(effects), 0)
    return float(np.mean(directions == direction))
