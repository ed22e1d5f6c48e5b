"""Tests of samples: the rank test of two samples, the sign test, and the correction of p-values.

The sign test of a median gives p-values of a difference and of equivalence, and an interval. It
counts the values above and below 0. It is exact for any distribution of the values, also if the
distribution is skewed, because it assumes only that the median is 0.

References
----------
Mann-Whitney test: H. B. Mann and D. R. Whitney, Annals of Mathematical Statistics 18 (1947).
Sign test: W. J. Dixon and A. M. Mood, Journal of the American Statistical Association 41 (1946).
Interval: W. R. Thompson, Annals of Mathematical Statistics 7 (1936).
Two one-sided tests: D. J. Schuirmann, Journal of Pharmacokinetics and Biopharmaceutics 15 (1987).
Holm's correction: S. Holm, Scandinavian Journal of Statistics 6 (1979).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from math import comb, nan
from typing import Literal

import numpy as np
import numpy.typing as npt
from scipy import special

from baldwinlab.analysis.statistics.bootstrap import CONFIDENCE_LEVEL, Sample
from baldwinlab.core.deferred import stats

# Largest product of the sample sizes for an exact p-value, reached by samples of 200 and 200. The
# exact distribution of larger samples takes long to compute, and is nearly normal.
MAX_EXACT_PAIRS = 40_000
# Largest number of divisions of tied values into two samples for an exact p-value.
MAX_EXACT_ARRANGEMENTS = 20_000
# Number of samples that are enumerated together, which bounds the memory.
SAMPLES_PER_BLOCK = 250


def _split_samples(samples: Sample) -> list[Sample]:
    """Split samples [sample, value] into blocks of at most `SAMPLES_PER_BLOCK` samples."""
    return np.array_split(samples, -(-samples.shape[0] // SAMPLES_PER_BLOCK))  # Rounded up.


def mann_whitney(a: Sample, b: Sample) -> tuple[float, float]:
    """Compute the Mann-Whitney test.

    p is exact without ties and with up to 40,000 pairs. With ties, p is exact if there are up to
    20,000 ways to divide the values into samples of the sizes of `a` and `b`. For example, samples
    of 8 and 8 have 12,870 ways. Otherwise p is the normal approximation with the corrections for
    ties and continuity.

    Parameters
    ----------
    a, b : Sample
        Finite values, at least one each.

    Returns
    -------
    u : float
        Pairs in which a is larger, where a tie counts half.
    p : float
        The two-sided p-value, which is 1 if all values are equal.

    Examples
    --------
    >>> u, p = mann_whitney(np.array([5.0, 6.0, 7.0]), np.array([1.0, 2.0, 3.0]))
    >>> u, round(p, 3)  # all 9 pairs have the larger value in a
    (9.0, 0.1)
    """
    pooled = np.concatenate([a, b])
    n_pairs = a.size * b.size
    if np.unique(pooled).size == 1:
        return n_pairs / 2, 1.0
    method: Literal["exact", "asymptotic"] = "asymptotic"
    if has_exact_mann_whitney(a, b):
        method = "exact"
    result = stats.mannwhitneyu(a, b, alternative="two-sided", method=method)
    u = float(result.statistic)
    if method == "asymptotic" and comb(pooled.size, a.size) <= MAX_EXACT_ARRANGEMENTS:
        ranks = stats.rankdata(pooled)[None]  # [sample, value], with one sample.
        return u, float(_enumerate_arrangements(ranks, a.size)[0])
    return u, float(result.pvalue)


def has_exact_mann_whitney(a: Sample, b: Sample) -> bool:
    """Return whether `mann_whitney` uses the exact distribution of values without ties."""
    has_ties = np.unique(np.concatenate([a, b])).size < a.size + b.size
    return not has_ties and a.size * b.size <= MAX_EXACT_PAIRS


def mann_whitney_tests(
    samples_a: Sample, samples_b: Sample, *, ignores_ties: bool
) -> tuple[Sample, Sample]:
    """Compute u and p [sample] of `mann_whitney` for each pair of samples [sample, value].

    `ignores_ties`: with too many arrangements to count, use the exact distribution without ties.
    This suits bootstrap samples, which repeat values, if the p-value of the original runs is exact.
    """
    size_a, size_b = samples_a.shape[1], samples_b.shape[1]
    if comb(size_a + size_b, size_a) <= MAX_EXACT_ARRANGEMENTS:
        ranks = stats.rankdata(np.concatenate([samples_a, samples_b], axis=1), axis=1)
        u = ranks[:, :size_a].sum(axis=1) - size_a * (size_a + 1) / 2
        p = [_enumerate_arrangements(block, size_a) for block in _split_samples(ranks)]
        return u, np.concatenate(p)
    method: Literal["exact", "asymptotic"] = "exact" if ignores_ties else "asymptotic"
    # SciPy divides by 0 if all values are equal.
    with np.errstate(invalid="ignore", divide="ignore"):
        result = stats.mannwhitneyu(samples_a, samples_b, axis=1, method=method)
    p_values = np.asarray(result.pvalue, np.float64)
    return np.asarray(result.statistic, np.float64), np.where(np.isnan(p_values), 1.0, p_values)


def _enumerate_arrangements(ranks: Sample, size_a: int) -> Sample:
    """Return the exact p-values [sample] of ranks [sample, value]. Ranks of sample a are first."""
    n_values = ranks.shape[1]
    # Both rank sums have the same two-sided p-value. The sum of the smaller sample has fewer terms.
    is_a_smaller = 2 * size_a <= n_values
    size = size_a if is_a_smaller else n_values - size_a
    smaller = ranks[:, :size_a] if is_a_smaller else ranks[:, size_a:]
    observed = smaller.sum(axis=1)[:, None]
    # [arrangement, value]: indices of ranks, for each way to choose the ranks of the sample.
    arrangements = np.array(list(combinations(range(n_values), size)))
    # [sample, arrangement]
    rank_sums = np.zeros((ranks.shape[0], len(arrangements)))
    for indices in arrangements.T:
        rank_sums += ranks[:, indices]
    share_below = (rank_sums <= observed).mean(axis=1)
    share_above = (rank_sums >= observed).mean(axis=1)
    return np.asarray(np.minimum(1.0, 2 * np.minimum(share_below, share_above)), np.float64)


def sign_tails(samples: Sample) -> tuple[Sample, Sample]:
    """Compute both one-sided p-values of the sign test for samples [sample, value].

    Returns the p-values [sample] of the alternatives that the median is below 0 and above 0. Values
    of 0 are ignored. p is 1 if all values are 0.
    """
    n_above = (samples > 0).sum(axis=1)
    n_below = (samples < 0).sum(axis=1)
    n_signs = n_above + n_below
    # The probability of at most this number of heads in `n_signs` throws of a coin.
    p_less, p_greater = (special.bdtr(count, n_signs, 0.5) for count in (n_above, n_below))
    return np.asarray(p_less, np.float64), np.asarray(p_greater, np.float64)


def sign_test(samples: Sample) -> Sample:
    """Compute the p-value of the two-sided sign test.

    Parameters
    ----------
    samples : np.ndarray
        Samples of paired differences [sample, value]. Differences of 0 are ignored.

    Returns
    -------
    np.ndarray
        The p-value of each sample. The null hypothesis is that the median is 0.

    Examples
    --------
    >>> sign_test(np.array([[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]])).tolist()
    [0.03125]
    """
    return np.asarray(np.minimum(1.0, 2 * np.minimum(*sign_tails(samples))), np.float64)


def equivalence_p(samples: Sample, bound: float) -> Sample:
    """Compute the p-value of two one-sided sign tests for samples [sample, value].

    One test shows that the median is below `bound`, and the other that it is above `-bound`. The
    result is the larger p-value [sample]. The bound is fixed before the data are seen.
    """
    below, _ = sign_tails(samples - bound)
    _, above = sign_tails(samples + bound)
    return np.asarray(np.maximum(below, above), np.float64)


def find_interval_rank(n_values: npt.ArrayLike) -> npt.NDArray[np.int64]:
    """Return the number k of the interval from the k-th smallest to the k-th largest value.

    The interval contains the median with a probability of at least 95 %. It excludes exactly the
    medians that the two-sided sign test rejects at the level 5 %. k is 0 without such an interval,
    which needs six values.
    """
    quantile = (1 - CONFIDENCE_LEVEL) / 2
    return np.asarray(stats.binom.ppf(quantile, np.maximum(n_values, 1), 0.5), np.int64)


def sign_interval(values: Sample) -> tuple[float, float]:
    """Compute the 95 % interval of the median by the sign test, which is NaN below six values."""
    rank = int(find_interval_rank(values.size))
    if rank == 0:
        return nan, nan
    ordered = np.sort(values)
    return float(ordered[rank - 1]), float(ordered[-rank])


def holm(ps: Sequence[float] | Sample) -> Sample:
    """Correct the p-values of a family of tests by Holm's step-down method.

    Parameters
    ----------
    ps : sequence of float or Sample
        p-values of all tests of the family, 0 to 1; may be empty.

    Returns
    -------
    Sample
        The corrected p-values in the order of `ps`. None is below its p-value or above 1.

    Examples
    --------
    >>> holm([0.01, 0.04, 0.03]).tolist()
    [0.03, 0.06, 0.06]
    """
    p_values = np.asarray(ps, np.float64)
    order = np.argsort(p_values, kind="stable")
    # The smallest p-value is multiplied by the number of tests, and the largest by 1.
    factors = np.arange(p_values.size, 0, -1)
    increasing = np.maximum.accumulate(p_values[order] * factors)
    corrected = np.empty_like(p_values)
    corrected[order] = np.minimum(increasing, 1)
    return corrected
