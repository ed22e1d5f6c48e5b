"""The sign test of a median: p-values of a difference and of equivalence, and the interval.

The test counts the values above and below 0. It is exact for any distribution of the values, also
if the distribution is skewed, because it assumes only that the median is 0.

References
----------
Sign test: W. J. Dixon and A. M. Mood, Journal of the American Statistical Association 41 (1946).
Interval: W. R. Thompson, Annals of Mathematical Statistics 7 (1936).
Two one-sided tests: D. J. Schuirmann, Journal of Pharmacokinetics and Biopharmaceutics 15 (1987).
"""

from __future__ import annotations

from math import nan

import numpy as np
import numpy.typing as npt
from scipy import special

from baldwinlab.analysis.statistics.bootstrap import CONFIDENCE_LEVEL, Sample
from baldwinlab.core.deferred import stats


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
