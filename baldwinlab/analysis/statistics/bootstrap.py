"""Bootstrap percentile intervals.

References
----------
B. Efron and R. Tibshirani, Introduction to the Bootstrap (1993), chapter 13.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from math import nan

import numpy as np
import numpy.typing as npt

from baldwinlab.analysis.statistics.samples import Sample, check_sample

# Number of bootstrap resamples.
RESAMPLES = 10_000
# Fixed seed of the resamples, which makes intervals reproducible.
SEED = 1896
CONFIDENCE_LEVEL = 0.95
# Largest sample whose resamples stay in memory: 80 MB.
MAX_CACHED_VALUES = 1000

Indices = npt.NDArray[np.int64]


def median_interval(values: Sequence[float] | Sample) -> tuple[float, float]:
    """Compute the 95 % bootstrap percentile interval of the median.

    Parameters
    ----------
    values
        Finite values, at least one.

    Returns
    -------
    low, high : float
        Ends of the interval. Both are NaN for a single value.

    Raises
    ------
    ValueError
        If there is no value, or if a value is not finite.
    """
    values = check_sample(values)
    if values.size == 1:
        return nan, nan
    return percentile_interval(resample_medians(values))


def resample_medians(values: Sample, generator: np.random.Generator | None = None) -> Sample:
    """Compute the median of each bootstrap resample.

    Parameters
    ----------
    values
        Finite values, [value].
    generator
        Generator of the resamples. Default: a new generator with the seed `SEED`.

    Returns
    -------
    Sample
        The medians, [resample].
    """
    if generator is not None:
        indices = _draw_indices(values.size, generator)
    elif values.size <= MAX_CACHED_VALUES:
        indices = _draw_first_indices(values.size)
    else:
        indices = _draw_indices(values.size, np.random.default_rng(SEED))
    ordered = values[indices]
    # Sorting is eight times as fast as `np.median`, and bit-identical.
    ordered.sort(axis=1)
    # Both are the middle value if the number of values is odd.
    upper_middle = values.size // 2
    lower_middle = (values.size - 1) // 2
    medians = (ordered[:, upper_middle] + ordered[:, lower_middle]) / 2
    return np.asarray(medians, np.float64)


# Most samples of a study have the same size, and drawing takes longer than sorting.
@lru_cache(maxsize=1)
def _draw_first_indices(n_values: int) -> Indices:
    """Return the first resamples of a generator with the seed `SEED`."""
    return _draw_indices(n_values, np.random.default_rng(SEED))


def _draw_indices(n_values: int, generator: np.random.Generator) -> Indices:
    """Return the indices of the values of each resample, [resample, value]."""
    return generator.integers(0, n_values, (RESAMPLES, n_values))


def percentile_interval(resampled: Sample) -> tuple[float, float]:
    """Compute the central 95 % interval of resampled values.

    Parameters
    ----------
    resampled
        The statistic of each resample, [resample].

    Returns
    -------
    low, high : float
        The percentiles 2.5 and 97.5.
    """
    low_quantile = (1 - CONFIDENCE_LEVEL) / 2
    high_quantile = (1 + CONFIDENCE_LEVEL) / 2
    low, high = np.quantile(resampled, [low_quantile, high_quantile])
    return float(low), float(high)
