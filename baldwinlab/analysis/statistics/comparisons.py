"""Comparisons of two samples, unpaired or in pairs, and the stability of their verdicts.

The stability of a verdict is the fraction of bootstrap samples of runs with the same verdict.

References
----------
A12: A. Vargha and H. D. Delaney, Journal of Educational and Behavioral Statistics 25 (2000).
Stability: B. Efron and R. Tibshirani, Introduction to the Bootstrap (1993), chapter 6.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from math import nan
from typing import NamedTuple

import numpy as np

from baldwinlab.analysis.statistics.bootstrap import (
    SEED,
    Indices,
    Sample,
    check_sample,
    draw_resamples,
    percentile_interval,
    resample_medians,
    split_resamples,
)
from baldwinlab.analysis.statistics.hypothesis_tests import (
    has_exact_mann_whitney,
    mann_whitney,
    mann_whitney_tests,
    sign_interval,
    sign_test,
)

# Largest factor in a logarithm of a ratio.
MAX_CHANGE = 100.0
# A verdict with a smaller stability is unstable.
MIN_STABILITY = 0.9
# Number of bootstrap samples of a stability.
STABILITY_RESAMPLES = 500


class Comparison(NamedTuple):
    """The comparison of sample a with sample b. A field without a value is NaN.

    Attributes
    ----------
    n_a, n_b : int
        Sizes of the samples.
    median_a, median_b : float
        Medians of the samples.
    effect : float
        Difference of the medians, a - b. For survival times, difference of the restricted means.
    low, high : float
        Ends of the 95 % bootstrap interval of the effect.
    u : float
        Number of pairs in which a is larger, where a tie counts half. For survival times, the
        log-rank statistic.
    p : float
        Two-sided p-value, uncorrected.
    a12 : float
        Probability that a value of a is larger than a value of b, where a tie counts half.
    """

    n_a: int
    n_b: int
    median_a: float = nan
    median_b: float = nan
    effect: float = nan
    low: float = nan
    high: float = nan
    u: float = nan
    p: float = nan
    a12: float = nan


class Pairs(NamedTuple):
    """The comparison of paired samples a and b. A field without a value is NaN.

    Attributes
    ----------
    n : int
        Number of pairs.
    median_a, median_b : float
        Medians of the samples.
    effect : float
        Median of the differences a - b.
    low, high : float
        Ends of the 95 % interval of the effect, by the sign test.
    p : float
        Two-sided p-value, uncorrected.
    above, below : int
        Numbers of pairs in which a is larger and smaller.
    """

    n: int
    median_a: float
    median_b: float
    effect: float
    low: float
    high: float
    p: float
    above: int
    below: int

    @property
    def a12(self) -> float:
        """Fraction of pairs in which a is larger, where a tie counts half."""
        ties = self.n - self.above - self.below
        return (self.above + ties / 2) / self.n


def compare(a: Sequence[float] | Sample, b: Sequence[float] | Sample) -> Comparison:
    """Compare two samples with the Mann-Whitney test, the difference of medians, and A12.

    Parameters
    ----------
    a, b : sequence of float or Sample
        Finite values, at least one each.

    Returns
    -------
    Comparison
        The comparison. If all values are equal, p is 1. If a sample has a single value, the
        interval is NaN.

    Raises
    ------
    ValueError
        If a sample is empty or has a value that is not finite.

    Examples
    --------
    >>> comparison = compare([5, 6, 7, 8], [1, 2, 3, 4])
    >>> comparison.effect, comparison.low, comparison.high, round(comparison.p, 3)
    (4.0, 2.0, 6.0, 0.029)
    >>> comparison.a12  # each value of a is larger than each value of b
    1.0
    """
    a = check_sample(a)
    b = check_sample(b)
    u, p = mann_whitney(a, b)
    low = high = nan
    if min(a.size, b.size) > 1:
        generator = np.random.default_rng(SEED)
        medians = resample_medians(a, generator) - resample_medians(b, generator)
        low, high = percentile_interval(medians)
    median_a = float(np.median(a))
    median_b = float(np.median(b))
    return Comparison(
        n_a=a.size,
        n_b=b.size,
        median_a=median_a,
        median_b=median_b,
        effect=median_a - median_b,
        low=low,
        high=high,
        u=u,
        p=p,
        a12=u / (a.size * b.size),
    )


def compare_pairs(a: Sequence[float] | Sample, b: Sequence[float] | Sample) -> Pairs:
    """Compare paired samples with the sign test and the median difference.

    Parameters
    ----------
    a, b : sequence of float or Sample
        Finite values, at least one each; `a[i]` and `b[i]` are a pair.

    Returns
    -------
    Pairs
        The comparison. If a equals b in all pairs, p is 1. The interval is NaN below six pairs.

    Raises
    ------
    ValueError
        If a sample is empty, has a value that is not finite, or the sizes differ.

    Examples
    --------
    >>> pairs = compare_pairs([3, 4, 5, 6, 7, 8], [2, 2, 2, 2, 2, 2])
    >>> pairs.effect, pairs.low, pairs.high, pairs.p
    (3.5, 1.0, 6.0, 0.03125)
    >>> pairs.above, pairs.below
    (6, 0)
    """
    a = check_sample(a)
    b = check_sample(b)
    if a.size != b.size:
        raise ValueError(f"samples of {a.size} and {b.size} are not pairs")
    differences = a - b
    low, high = sign_interval(differences)
    return Pairs(
        n=a.size,
        median_a=float(np.median(a)),
        median_b=float(np.median(b)),
        effect=float(np.median(differences)),
        low=low,
        high=high,
        p=float(sign_test(differences[None])[0]),  # A single sample.
        above=int((differences > 0).sum()),
        below=int((differences < 0).sum()),
    )


def compare_paired(a: Sequence[float] | Sample, b: Sequence[float] | Sample) -> Comparison:
    """Compare paired samples, with the result as a `Comparison`.

    Parameters
    ----------
    a, b : sequence of float or Sample
        Finite values, at least one each; `a[i]` and `b[i]` are a pair.

    Returns
    -------
    Comparison
        `p` is the p-value of the sign test, `effect` the median difference, and `a12` the
        fraction of pairs in which a is larger, where a tie counts half. `u` is NaN.

    Raises
    ------
    ValueError
        If a sample is empty, has a value that is not finite, or the sizes differ.

    Examples
    --------
    >>> comparison = compare_paired([3, 4, 5, 6, 7, 8], [2, 2, 2, 2, 2, 2])
    >>> comparison.effect, comparison.a12
    (3.5, 1.0)
    """
    pairs = compare_pairs(a, b)
    # The fields of both classes from `median_a` to `high` are the same.
    return Comparison(pairs.n, pairs.n, *pairs[1:6], p=pairs.p, a12=pairs.a12)


def log_ratio(a: Sample, b: Sample) -> Sample:
    """Compute the logarithm of a ratio.

    Parameters
    ----------
    a, b : np.ndarray
        Numerators and denominators [run], at least 0.

    Returns
    -------
    np.ndarray
        log(a / b) for each run, and 0 where both values are 0. A factor beyond `MAX_CHANGE` counts
        as `MAX_CHANGE`, so that a value of 0 has a logarithm.

    Examples
    --------
    >>> log_ratio(np.array([2.0, 0.0, 0.0]), np.array([1.0, 0.0, 1.0])).round(2).tolist()
    [0.69, 0.0, -4.61]
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = np.where((a == 0) & (b == 0), 1.0, a / b)
    return np.asarray(np.log(ratio.clip(1 / MAX_CHANGE, MAX_CHANGE)), np.float64)


def verdict_stability(
    values: Sample, verdict: str, decide: Callable[[Sample], Sequence[str]]
) -> float:
    """Compute the fraction of bootstrap samples of runs with the same verdict.

    `decide` returns the verdict on each sample of values [sample, run].
    """
    batches = draw_resamples(np.random.default_rng(SEED), STABILITY_RESAMPLES, values.size)
    n_equal = sum(list(decide(values[indices])).count(verdict) for indices in batches)
    return n_equal / STABILITY_RESAMPLES


def direction_stability(
    a: Sample, b: Sample, direction: int, level: float, *, is_paired: bool
) -> float:
    """Compute the fraction of bootstrap samples of runs with the same direction of a test.

    `direction` is 1, -1 or 0, and `level` is the level of the uncorrected p-value. The p-value of a
    bootstrap sample uses an exact distribution if the p-value of the runs is exact.
    """
    if is_paired:
        batches = draw_resamples(np.random.default_rng(SEED), STABILITY_RESAMPLES, a.size)
        directions = [_find_paired_directions((a - b)[indices], level) for indices in batches]
    else:
        ignores_ties = has_exact_mann_whitney(a, b)
        directions = [
            _find_directions(a[indices_a], b[indices_b], level, ignores_ties=ignores_ties)
            for indices_a, indices_b in _draw_two_samples(a.size, b.size)
        ]
    return float(np.mean(np.concatenate(directions) == direction))


def _draw_two_samples(size_a: int, size_b: int) -> Iterator[tuple[Indices, Indices]]:
    """Yield batches of indices [resample, run] of both samples.

    One generator would draw all resamples of `a` before those of `b`. Two generators give the same
    indices batch by batch: `generator_b` first skips the random numbers of `a`.
    """
    generator_a, generator_b = np.random.default_rng(SEED), np.random.default_rng(SEED)
    for _ in draw_resamples(generator_b, STABILITY_RESAMPLES, size_a):
        pass
    for n_rows in split_resamples(STABILITY_RESAMPLES, size_a + size_b):
        yield (
            generator_a.integers(0, size_a, (n_rows, size_a)),
            generator_b.integers(0, size_b, (n_rows, size_b)),
        )


def _find_paired_directions(differences: Sample, level: float) -> Sample:
    """Return the direction of the sign test of each sample [sample, pair]."""
    # Ties count half in A12.
    a12 = 0.5 + np.sign(differences).mean(axis=1) / 2
    return _find_significant(np.median(differences, axis=1), sign_test(differences), a12, level)


def _find_directions(
    samples_a: Sample, samples_b: Sample, level: float, *, ignores_ties: bool
) -> Sample:
    """Return the direction of the Mann-Whitney test of each pair of samples [sample, run]."""
    effects = np.median(samples_a, axis=1) - np.median(samples_b, axis=1)
    u, p = mann_whitney_tests(samples_a, samples_b, ignores_ties=ignores_ties)
    a12 = u / (samples_a.shape[1] * samples_b.shape[1])
    return _find_significant(effects, p, a12, level)


def _find_significant(effects: Sample, p: Sample, a12: Sample, level: float) -> Sample:
    """Return the sign of each effect, or 0 if p is not below the level or A12 has another sign."""
    is_significant = (p < level) & (np.sign(effects) == np.sign(a12 - 0.5))
    return np.where(is_significant, np.sign(effects), 0)
