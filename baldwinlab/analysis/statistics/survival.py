"""Comparison of two samples of survival times. Some times may be censored.

A time is censored if the observation ends before death: the true time is at least as long.

References
----------
Log-rank test: N. Mantel, Cancer Chemotherapy Reports 50 (1966).
Survival curve: E. L. Kaplan and P. Meier, J. of the American Statistical Association 53 (1958).
Restricted mean: P. Royston and M. K. B. Parmar, BMC Medical Research Methodology 13 (2013).
Pairs with censored times: E. A. Gehan, Biometrika 52 (1965).
"""

from __future__ import annotations

from math import inf, nan
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy import stats

from baldwinlab.analysis.statistics.bootstrap import (
    RESAMPLES,
    SEED,
    Sample,
    check_sample,
    percentile_interval,
    split_resamples,
)
from baldwinlab.analysis.statistics.comparisons import Comparison

# Tolerance of comparisons with a survival curve, because the curve is a product of rounded numbers.
ROUNDING_TOLERANCE = 1e-9
# Number of runs that are compared with another sample at once, which limits the memory.
ROWS_PER_BATCH = 256


class Survival(NamedTuple):
    """The survival times of the runs of a condition.

    Attributes
    ----------
    times : array of float64, [run]
        Times above 0, in any unit.
    censored : array of bool, [run]
        True if the run survived longer than its time.
    """

    times: Sample
    censored: npt.NDArray[np.bool_]

    @property
    def follow_up(self) -> float:
        """The time up to which the curve is defined. Infinite if the last event is a death."""
        last_time = float(self.times.max())
        return last_time if self.censored[self.times == last_time].any() else inf


def compare_survival(a: Survival, b: Survival) -> Comparison:
    """Compare two samples with the log-rank test, restricted means, and A12.

    A restricted mean is the area under the Kaplan-Meier curve, up to the time at which both curves
    are defined. In the result, `effect` is the difference of the restricted means. Its bootstrap
    interval is NaN for a sample of one run. `median_a` and `median_b` are the medians of the
    curves, or NaN if the curve does not fall below 1/2. `u` is the log-rank statistic, above 0 if a
    survives longer. If the log-rank statistic is undefined, `u` is 0 and `p` is 1. In `a12`, a pair
    counts half if censoring hides which of the two survives longer.
    """
    a = _check_survival(a)
    b = _check_survival(b)
    longest = max(float(a.times.max()), float(b.times.max()))
    # Both curves are defined up to this time.
    end_time = min(a.follow_up, b.follow_up, longest)
    low = high = nan
    if min(a.times.size, b.times.size) > 1:
        generator = np.random.default_rng(SEED)
        means_a = _resample_means(a, end_time, generator)
        means_b = _resample_means(b, end_time, generator)
        low, high = percentile_interval(means_a - means_b)
    statistic, p = log_rank(a, b)
    share_a_outlives = _share_of_certain_pairs(a, b)
    share_b_outlives = _share_of_certain_pairs(b, a)
    return Comparison(
        n_a=a.times.size,
        n_b=b.times.size,
        median_a=median(a),
        median_b=median(b),
        effect=float(restricted_mean(a, end_time) - restricted_mean(b, end_time)),
        low=low,
        high=high,
        u=statistic,
        p=p,
        # A pair without a certain winner counts half.
        a12=(1 + share_a_outlives - share_b_outlives) / 2,
    )


def _check_survival(sample: Survival) -> Survival:
    return Survival(check_sample(sample.times), np.asarray(sample.censored, np.bool_))


def log_rank(a: Survival, b: Survival) -> tuple[float, float]:
    """Return the log-rank statistic and the two-sided p-value, or (0, 1) without a result.

    The statistic is standard normal if the samples have the same distribution, and above 0 if a
    survives longer.
    """
    censored_a = stats.CensoredData.right_censored(a.times, a.censored)
    censored_b = stats.CensoredData.right_censored(b.times, b.censored)
    with np.errstate(invalid="ignore"):
        result = stats.logrank(censored_a, censored_b)
    if np.isnan(result.pvalue):
        return 0.0, 1.0
    # The statistic of SciPy is below 0 if a survives longer.
    return -float(result.statistic), float(result.pvalue)


def median(sample: Survival) -> float:
    """Compute the median survival time from the Kaplan-Meier curve.

    The median is the time at which the curve falls below 1/2, or the middle of the interval in
    which the curve equals 1/2. The median is NaN if the curve does not fall below 1/2.
    """
    times, share_alive = _compute_curve(sample, np.ones(sample.times.size))
    times_at_most_half = times[share_alive < 0.5 + ROUNDING_TOLERANCE]
    times_below_half = times[share_alive < 0.5 - ROUNDING_TOLERANCE]
    if not times_below_half.size:
        return nan
    return float(times_at_most_half[0] + times_below_half[0]) / 2


def restricted_mean(
    sample: Survival, end_time: float, counts: npt.NDArray[np.int64] | None = None
) -> Sample:
    """Compute the area under the Kaplan-Meier curve up to a time, for each resample.

    `counts` is the number of times that each resample contains each run, [..., run], in the order
    of the times. By default, each run counts once.
    """
    run_counts = np.ones(sample.times.size) if counts is None else counts
    times, share_alive = _compute_curve(sample, run_counts)
    durations = np.diff(np.minimum(times, end_time), prepend=0, append=end_time)
    # All runs are alive before the first time.
    return np.asarray(durations[0] + share_alive @ durations[1:], np.float64)


def _compute_curve(sample: Survival, counts: npt.NDArray[np.generic]) -> tuple[Sample, Sample]:
    """Return the sorted times [run], and the fraction alive after each time, [..., run].

    `counts` [..., run] are in the order of the times. At equal times, deaths precede censoring.
    """
    order = np.lexsort((sample.censored, sample.times))
    # The number of runs that are alive before each time: a cumulative sum from the end.
    n_at_risk = np.cumsum(counts[..., ::-1], axis=-1)[..., ::-1]
    share_dying = counts * ~sample.censored[order] / np.maximum(1, n_at_risk)
    return sample.times[order], np.cumprod(1 - share_dying, axis=-1)


def _resample_means(sample: Survival, end_time: float, generator: np.random.Generator) -> Sample:
    """Compute the restricted mean of each bootstrap resample, in batches that bound the memory."""
    size = sample.times.size
    # Runs are exchangeable, so the counts of a resample apply to the runs in any order.
    return np.concatenate(
        [
            restricted_mean(
                sample, end_time, generator.multinomial(size, np.full(size, 1 / size), n_rows)
            )
            for n_rows in split_resamples(RESAMPLES, size)
        ]
    )


def _share_of_certain_pairs(a: Survival, b: Survival) -> float:
    """Return the fraction of pairs in which a certainly survives longer than b."""
    n_pairs = 0
    # Batches of at most `ROWS_PER_BATCH` indices. The number of batches is rounded up.
    for rows in np.array_split(np.arange(a.times.size), -(-a.times.size // ROWS_PER_BATCH)):
        # Columns, so that the results are [a, b].
        times_a = a.times[rows, None]
        is_longer = times_a > b.times
        is_censored_later = (times_a == b.times) & a.censored[rows, None]
        n_pairs += int(((is_longer | is_censored_later) & ~b.censored).sum())
    return n_pairs / (a.times.size * b.times.size)
