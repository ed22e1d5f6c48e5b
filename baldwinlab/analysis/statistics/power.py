"""Number of runs that would decide a question if the effect is the observed one.

References
----------
E. L. Lehmann, Nonparametrics: Statistical Methods Based on Ranks (1975), section 4.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import count
from math import ceil, isfinite, log2, sqrt

import numpy as np
from scipy import stats

from baldwinlab.analysis.statistics.comparisons import Comparison
from baldwinlab.analysis.statistics.sample_sizes import (
    MIN_INTERVAL_RUNS,
    SIGNIFICANCE_LEVEL,
    PlannedTest,
)
from baldwinlab.analysis.statistics.samples import Sample

# Probability that a study of the required size detects the effect.
POWER = 0.8
# Larger numbers of runs are not realistic.
MAX_RUNS = 10_000


def signed_rank_runs(differences: Sample, level: float) -> int | None:
    """Compute the number of runs that detects the observed effect with a probability of 80 %.

    `differences` are at least two finite values, and `level` is corrected for the other tests. The
    result is None if more than `MAX_RUNS` runs are needed. It is never less than the smallest
    number of runs with which the test can be significant.
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


def level_of_next_test(corrected: Sequence[float] | Sample) -> float:
    """Compute the level of the next test that Holm's method would find significant.

    It is the level of significance, divided by the number of tests that are not significant.
    """
    n_undecided = int((np.asarray(corrected, np.float64) >= SIGNIFICANCE_LEVEL).sum())
    return SIGNIFICANCE_LEVEL / max(1, n_undecided)


def levels_of_tests(corrected: Sequence[float] | Sample) -> Sample:
    """Compute the level at which Holm's method tests each p-value of a family.

    It is the level of significance, divided by the number of tests whose p-values are not smaller.
    Tests that are not significant have the level of `level_of_next_test`.
    """
    p_values = np.asarray(corrected, np.float64)
    n_not_smaller = (p_values[:, None] <= p_values).sum(axis=1)
    levels = SIGNIFICANCE_LEVEL / np.maximum(1, n_not_smaller)
    return np.where(p_values < SIGNIFICANCE_LEVEL, levels, level_of_next_test(p_values))


def rank_test_runs(test: PlannedTest, p: float, level: float) -> int | None:
    """Compute the number of runs with which a rank test detects the observed effect.

    The normal score of p grows with the square root of the number of runs. `p` is uncorrected, and
    `level` is corrected for the other tests. The result is the number of runs of each condition for
    a probability of 80 %, or None if more than `MAX_RUNS` runs are needed.
    """
    score = float(stats.norm.isf(p / 2))
    if score <= 0:
        return None
    n_runs = 2 * test.n_a * test.n_b / (test.n_a + test.n_b)
    quantiles = float(stats.norm.isf(level / 2)) + float(stats.norm.ppf(POWER))
    sizes = (runs for runs in count(1) if test._replace(n_a=runs, n_b=runs).smallest_p < level)
    required = max(ceil(n_runs * (quantiles / score) ** 2), next(sizes))
    return required if required <= MAX_RUNS else None


def interval_runs(comparison: Comparison, bounds: Sequence[float]) -> int | None:
    """Compute the number of runs whose interval of the observed effect contains no bound.

    It is at least `MIN_INTERVAL_RUNS`.

    The width of an interval decreases with the square root of the number of runs. An infinite bound
    is not used. The result is the number of runs for a probability of 80 %, or None if it is
    undefined or more than `MAX_RUNS`.
    """
    distance = min(abs(comparison.effect - bound) for bound in bounds if isfinite(bound))
    half_width = (comparison.high - comparison.low) / 2
    if not (distance > 0 and isfinite(half_width)):
        return None
    quantile = float(stats.norm.isf(SIGNIFICANCE_LEVEL / 2))
    widening = 1 + float(stats.norm.ppf(POWER)) / quantile
    n_runs = max(comparison.n_a, comparison.n_b)
    required = max(MIN_INTERVAL_RUNS, ceil(n_runs * (widening * half_width / distance) ** 2))
    return required if required <= MAX_RUNS else None


def describe_required_runs(required_runs: int | None) -> str:
    """Describe the number of runs that would decide a question; None means no realistic number."""
    number = "no realistic number of" if required_runs is None else f"about {required_runs:,}"
    return f"{number} runs would decide this if the effect is the observed one"
