"""Rank tests of two samples, and the correction of p-values for several tests.

References
----------
Mann-Whitney test: H. B. Mann and D. R. Whitney, Annals of Mathematical Statistics 18 (1947).
Signed-rank test: F. Wilcoxon, Biometrics 1 (1945).
Holm's correction: S. Holm, Scandinavian Journal of Statistics 6 (1979).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from math import comb
from typing import Literal

import numpy as np
from scipy import stats

from baldwinlab.analysis.statistics.samples import Sample

# Largest product of the sample sizes for an exact p-value, reached by samples of 200 and 200. The
# exact distribution of larger samples takes long to compute, and is nearly normal.
MAX_EXACT_PAIRS = 40_000
# Largest number of divisions of tied values into two samples for an exact p-value.
MAX_EXACT_ARRANGEMENTS = 20_000
# Largest number of differences for which all 2**n combinations of signs are enumerated.
MAX_EXACT_SIGNS = 13
# Number of samples whose signs are enumerated together, which bounds the memory.
SAMPLES_PER_BLOCK = 250


def signed_rank(differences: Sample) -> float:
    """Compute the two-sided p-value of Wilcoxon's signed-rank test.

    p is exact for up to 13 differences, with or without ties, and for up to 50 without ties.
    Otherwise it is the normal approximation with the correction for ties.

    Parameters
    ----------
    differences
        Differences of the pairs, [pair]. At least one must not be 0; zeros are ignored.

    Returns
    -------
    float
        The p-value, above 0 and at most 1.
    """
    nonzero = differences[differences != 0]
    sizes = np.abs(nonzero)
    # A difference of 0 counts as a tie.
    has_ties = np.unique(sizes).size < differences.size
    if differences.size > MAX_EXACT_SIGNS or not has_ties:
        return float(stats.wilcoxon(differences).pvalue)
    # SciPy would take a second or more, because it enumerates the signs one at a time.
    share_below, share_above = _enumerate_signs(differences[None])
    return min(1.0, 2 * min(float(share_below[0]), float(share_above[0])))


def signed_rank_tails(samples: Sample) -> tuple[Sample, Sample]:
    """Compute both one-sided p-values of Wilcoxon's signed-rank test for samples [sample, pair].

    The alternatives are that differences are below 0 and above 0. p is exact for up to 13
    differences. For more, it is that of SciPy. Zeros are ignored. p is 1 if all differences are 0.
    """
    if samples.shape[1] <= MAX_EXACT_SIGNS:
        blocks = np.array_split(samples, -(-samples.shape[0] // SAMPLES_PER_BLOCK))
        tails = [_enumerate_signs(block) for block in blocks]
        share_below, share_above = (np.concatenate(tail) for tail in zip(*tails, strict=True))
        return share_below, share_above
    # SciPy divides by 0 if all differences are 0.
    with np.errstate(invalid="ignore", divide="ignore"):
        p_less, p_greater = (
            stats.wilcoxon(samples, axis=1, alternative=alternative).pvalue
            for alternative in ("less", "greater")
        )
    return np.where(np.isnan(p_less), 1.0, p_less), np.where(np.isnan(p_greater), 1.0, p_greater)


def _enumerate_signs(samples: Sample) -> tuple[Sample, Sample]:
    """Return the shares of all signs with a rank sum at most and at least the observed one."""
    sizes = np.abs(samples)
    n_zeros = (sizes == 0).sum(axis=1, keepdims=True)
    # Ranks among the differences that are not 0, [sample, pair]. A difference of 0 has no rank.
    ranks = np.where(sizes > 0, stats.rankdata(sizes, axis=1) - n_zeros, 0.0)
    n_pairs = samples.shape[1]
    # The bits of a number are a combination of signs, [combination, pair]: 1 is positive.
    is_positive = (np.arange(2**n_pairs)[:, None] >> np.arange(n_pairs)) & 1
    # [combination, sample]
    rank_sums = is_positive.astype(np.float64) @ ranks.T
    observed = np.where(samples > 0, ranks, 0.0).sum(axis=1)
    return (rank_sums <= observed).mean(axis=0), (rank_sums >= observed).mean(axis=0)


def mann_whitney(a: Sample, b: Sample) -> tuple[float, float]:
    """Compute the Mann-Whitney test.

    p is exact without ties and with up to 40,000 pairs. With ties, it is exact if there are up to
    20,000 ways to divide the values into samples of the sizes of `a` and `b`. Samples of 8 and 8
    have 12,870 ways.
    Otherwise it is the normal approximation with the corrections for ties and continuity.

    Parameters
    ----------
    a, b
        Finite values, at least one each.

    Returns
    -------
    u : float
        Pairs in which a is larger, where a tie counts half.
    p : float
        The two-sided p-value. If all values are equal, it is 1.
    """
    pooled = np.concatenate([a, b])
    n_distinct = np.unique(pooled).size
    n_pairs = a.size * b.size
    if n_distinct == 1:
        return n_pairs / 2, 1.0
    has_ties = n_distinct < pooled.size
    method: Literal["exact", "asymptotic"] = "asymptotic"
    if not has_ties and n_pairs <= MAX_EXACT_PAIRS:
        method = "exact"
    result = stats.mannwhitneyu(a, b, alternative="two-sided", method=method)
    u = float(result.statistic)
    if has_ties and comb(pooled.size, a.size) <= MAX_EXACT_ARRANGEMENTS:
        return u, _p_of_all_arrangements(stats.rankdata(pooled), a.size)
    return u, float(result.pvalue)


def _p_of_all_arrangements(ranks: Sample, size_a: int) -> float:
    """Compute the exact p-value of the rank sum of sample a: of the first `size_a` ranks."""
    # [arrangement, value]: indices of ranks, for each way to choose the ranks of sample a.
    arrangements = list(combinations(range(ranks.size), size_a))
    rank_sums = ranks[arrangements].sum(axis=1)
    observed_rank_sum = float(ranks[:size_a].sum())
    return _two_sided_p(rank_sums, observed_rank_sum)


def _two_sided_p(rank_sums: Sample, observed_rank_sum: float) -> float:
    """Return twice the share of the rank sums at least as extreme as the observed one."""
    share_below = float(np.mean(rank_sums <= observed_rank_sum))
    share_above = float(np.mean(rank_sums >= observed_rank_sum))
    return min(1.0, 2 * min(share_below, share_above))


def holm(ps: Sequence[float] | Sample) -> Sample:
    """Correct the p-values of a family of tests by Holm's step-down method.

    Parameters
    ----------
    ps
        p-values of all tests of the family, 0 to 1; may be empty.

    Returns
    -------
    Sample
        The corrected p-values in the order of `ps`. None is below its p-value or above 1.
    """
    p_values = np.asarray(ps, np.float64)
    order = np.argsort(p_values, kind="stable")
    # The smallest p-value is multiplied by the number of tests, and the largest by 1.
    factors = np.arange(p_values.size, 0, -1)
    increasing = np.maximum.accumulate(p_values[order] * factors)
    corrected = np.empty_like(p_values)
    corrected[order] = np.minimum(increasing, 1)
    return corrected
