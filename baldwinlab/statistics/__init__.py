"""Two samples compared, apart or in pairs, and a family of tests corrected: plain NumPy and SciPy, no labels.

Sources: H. B. Mann and D. R. Whitney, Annals of Mathematical Statistics 18 (1947); F. Wilcoxon, Biometrics 1 (1945), for
pairs; A. Vargha and H. D. Delaney, Journal of Educational and Behavioral Statistics 25 (2000), for A12; B. Efron and
R. Tibshirani, An Introduction to the Bootstrap (1993), chapter 13, for the percentile interval; S. Holm, Scandinavian Journal
of Statistics 6 (1979).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from math import comb, nan
from typing import Any, Literal, NamedTuple

import numpy as np
from scipy import stats

Sample = np.ndarray[Any, np.dtype[np.float64]]

RESAMPLES = 10_000
SEED = 1896  # of the bootstrap alone, so that an interval is the same each time
LEVEL = 0.95
EXACT_PAIRS = 40_000  # 200 and 200; the exact distribution of larger samples takes long, and is the normal one by then
ARRANGEMENTS = 20_000
MOST_SIGNS = 13  # differences, whose signs are all tried


class Comparison(NamedTuple):
    """Sample a against sample b; NaN where a number does not exist."""

    n_a: int
    n_b: int
    median_a: float
    median_b: float
    effect: float  # difference of the medians, a - b; of survival times, of the restricted means
    low: float  # 95 % bootstrap interval of the effect
    high: float
    u: float  # pairs in which a is the larger, ties counting half; of survival times, the log-rank statistic
    p: float  # two-sided
    a12: float  # probability that a member of a is larger than one of b, ties counting half


class Pairs(NamedTuple):
    """Sample a against sample b, member by member; NaN where a number does not exist."""

    n: int
    median_a: float
    median_b: float
    effect: float  # median of the differences a - b
    low: float  # 95 % bootstrap interval of the effect
    high: float
    p: float  # two-sided
    above: int  # pairs in which a is the larger
    below: int  # pairs in which a is the smaller


class Summary(NamedTuple):
    n: int
    median: float
    mean: float
    lower_quartile: float
    upper_quartile: float
    min: float
    max: float


def compare(a: Sequence[float] | Sample, b: Sequence[float] | Sample) -> Comparison:
    """Mann-Whitney test, difference of medians with its bootstrap interval, and A12.

    The interval is NaN where a sample has a single member; equal samples have p = 1.
    Raises ValueError where a sample is empty or has a value that is not finite.
    """
    a, b = checked(a), checked(b)
    u, p = mann_whitney(a, b)
    low, high = (nan, nan)
    if min(a.size, b.size) > 1:
        generator = np.random.default_rng(SEED)
        low, high = percentiles(_resampled_medians(a, generator) - _resampled_medians(b, generator))
    medians = float(np.median(a)), float(np.median(b))
    return Comparison(
        a.size, b.size, *medians, medians[0] - medians[1], low, high, u, p, u / (a.size * b.size)
    )


def compare_pairs(a: Sequence[float] | Sample, b: Sequence[float] | Sample) -> Pairs:
    """Wilcoxon's signed-rank test of the differences, and their median with its bootstrap interval.

    The interval is NaN for a single pair; pairs that are all equal have p = 1.
    Raises ValueError as `compare` does, and where the samples differ in size.
    """
    a, b = checked(a), checked(b)
    if a.size != b.size:
        raise ValueError(f"samples of {a.size} and {b.size} are not pairs")
    differences = a - b
    p = signed_rank(differences) if differences.any() else 1.0
    medians = float(np.median(a)), float(np.median(b)), float(np.median(differences))
    above, below = int((differences > 0).sum()), int((differences < 0).sum())
    return Pairs(a.size, *medians, *median_interval(differences), p, above, below)


def paired(a: Sequence[float] | Sample, b: Sequence[float] | Sample) -> Comparison:
    """As `compare`, of pairs: p is Wilcoxon's, the effect the median difference, A12 the share of pairs in which a is larger.

    Pairs that are equal count half. There is no U. Raises ValueError as `compare_pairs` does.
    """
    found = compare_pairs(a, b)
    share = (found.above + (found.n - found.above - found.below) / 2) / found.n
    interval = found.effect, found.low, found.high
    return Comparison(
        found.n, found.n, found.median_a, found.median_b, *interval, nan, found.p, share
    )


def signed_rank(differences: Sample) -> float:
    """The two-sided p of Wilcoxon's signed-rank test; differences of 0 are left out, and one must be another.

    p is exact for at most 13 differences, all ways to give them signs being tried where there are ties, and without ties for
    at most 50. Else it is the normal approximation with the correction for ties.
    """
    left = differences[differences != 0]
    sizes = np.abs(left)
    if differences.size > MOST_SIGNS or np.unique(sizes).size == differences.size:
        return float(stats.wilcoxon(differences).pvalue)
    ranks = stats.rankdata(
        sizes
    )  # SciPy tries them, too, but one by one, which takes a second and more
    signs = (np.arange(2**left.size)[:, None] >> np.arange(left.size)) & 1
    return _two_sided(np.asarray(signs @ ranks, np.float64), float(ranks[left > 0].sum()))


def mann_whitney(a: Sample, b: Sample) -> tuple[float, float]:
    """U of `a`, and the two-sided p.

    p is exact where there are no ties and at most 40,000 pairs. It is exact also with ties where there are at most 20,000
    ways to deal the values to two samples of these sizes (8 and 8 have 12,870), which are then all tried. Else it is the
    normal approximation with the corrections for ties and for continuity.
    """
    pooled = np.concatenate([a, b])
    distinct, pairs = np.unique(pooled).size, a.size * b.size
    if distinct == 1:
        return pairs / 2, 1.0
    method: Literal["exact", "asymptotic"] = (
        "exact" if distinct == pooled.size and pairs <= EXACT_PAIRS else "asymptotic"
    )
    result = stats.mannwhitneyu(a, b, alternative="two-sided", method=method)
    if distinct < pooled.size and comb(pooled.size, a.size) <= ARRANGEMENTS:
        return float(result.statistic), _p_of_all_arrangements(stats.rankdata(pooled), a.size)
    return float(result.statistic), float(result.pvalue)


def _p_of_all_arrangements(ranks: Sample, size: int) -> float:
    """Twice the share of the ways to deal the ranks that give the first `size` a sum as far out as theirs, or farther."""
    sums = ranks[list(combinations(range(ranks.size), size))].sum(axis=1)
    return _two_sided(sums, float(ranks[:size].sum()))


def _two_sided(sums: Sample, found: float) -> float:
    """Twice the share of the sums that are as far out as the one that was found, or farther."""
    return min(1.0, 2 * min(float(np.mean(sums <= found)), float(np.mean(sums >= found))))


def median_interval(values: Sequence[float] | Sample) -> tuple[float, float]:
    """95 % bootstrap percentile interval of the median; NaN for a single value. Raises as `compare` does."""
    values = checked(values)
    if values.size == 1:
        return nan, nan
    return percentiles(_resampled_medians(values, np.random.default_rng(SEED)))


def _resampled_medians(values: Sample, generator: np.random.Generator) -> Sample:
    """Return the median of each resample; sorting is eight times as fast as `np.median`, with the same bits."""
    picks = generator.integers(0, values.size, (RESAMPLES, values.size))
    ordered, middle = np.sort(values[picks], axis=1), values.size // 2
    return np.asarray((ordered[:, middle] + ordered[:, (values.size - 1) // 2]) / 2, np.float64)


def percentiles(resampled: Sample) -> tuple[float, float]:
    low, high = np.quantile(resampled, [(1 - LEVEL) / 2, (1 + LEVEL) / 2])
    return float(low), float(high)


def holm(ps: Sequence[float] | Sample) -> Sample:
    """p-values corrected for being a family, by Holm's step-down method, in the order given."""
    family = np.asarray(ps, np.float64)
    order = np.argsort(family, kind="stable")
    stepped = np.maximum.accumulate(family[order] * np.arange(family.size, 0, -1))
    corrected = np.empty_like(family)
    corrected[order] = np.minimum(stepped, 1)
    return corrected


def summarise(values: Sequence[float] | Sample) -> Summary:
    """Raises ValueError where there is no value, or one that is not finite."""
    values = checked(values)
    lower, median, upper = (float(quartile) for quartile in np.quantile(values, [0.25, 0.5, 0.75]))
    return Summary(
        values.size,
        median,
        float(values.mean()),
        lower,
        upper,
        float(values.min()),
        float(values.max()),
    )


def checked(values: Sequence[float] | Sample) -> Sample:
    sample = np.asarray(values, np.float64).ravel()
    if sample.size == 0 or not np.isfinite(sample).all():
        raise ValueError("a sample needs at least one value, and all finite")
    return sample
