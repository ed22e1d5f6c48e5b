"""Bootstrap intervals of the mean and of the median of fitness curves."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from scipy import stats

# Probabilities of the ends of a 95 % interval.
LOW_QUANTILE = 0.025
HIGH_QUANTILE = 0.975


class CurveInterval(NamedTuple):
    """A mean or a median, and the ends of its 95 % interval.

    Attributes
    ----------
    center, low, high : xarray.DataArray
        Values without the dimension of the sample. The ends are NaN for small samples.
    """

    center: xr.DataArray
    low: xr.DataArray
    high: xr.DataArray


def interval_of_mean(values: xr.DataArray, over: str = "run") -> CurveInterval:
    """Compute the mean and its 95 % interval by Student's t, which is NaN for a single value.

    If no value is negative, the interval is cut off at 0. It is also cut off at the attribute
    `valid_max` of the values, which is 1 for shares. Neither cut changes the coverage.
    """
    count = values.count(over)
    average = values.mean(over)
    variance = ((values - average) ** 2).sum(over) / (count - 1).where(count > 1)
    quantiles = stats.t.ppf(HIGH_QUANTILE, np.maximum(count - 1, 1))
    half_width = np.sqrt(variance / count) * xr.zeros_like(average).copy(data=quantiles)
    low = average - half_width
    if not bool((values < 0).any()):
        low = low.clip(min=0)
    high = (average + half_width).clip(max=values.attrs.get("valid_max"))
    return CurveInterval(average, low, high)


def interval_of_median(values: xr.DataArray, over: str = "run") -> CurveInterval:
    """Compute the median and its 95 % interval by the sign test, which is NaN below six values.

    The interval is valid for any distribution. It reaches from the k-th smallest to the k-th
    largest value, where k is the 2.5 % quantile of the binomial distribution with probability 1/2
    (W. R. Thompson, Annals of Mathematical Statistics 7, 1936).
    """
    count = values.count(over)
    # NaN is sorted to the end.
    ordered = np.sort(values.transpose(..., over).values, axis=-1)
    # The number k of the docstring. If k is 0, there is no interval.
    rank = stats.binom.ppf(LOW_QUANTILE, np.maximum(count.values, 1), 0.5).astype(np.int64)
    has_interval = rank > 0
    low = np.where(has_interval, _take_along_last(ordered, rank - 1), np.nan)
    high = np.where(has_interval, _take_along_last(ordered, count.values - rank), np.nan)
    return CurveInterval(values.median(over), count.copy(data=low), count.copy(data=high))


def tabulate_interval(
    interval: CurveInterval, center: str = "median", **columns: xr.DataArray
) -> list[dict[str, Any]]:
    """Return the rows of a table: coordinates, `columns`, the mean or median, low and high."""
    numbers = {center: interval.center, "low": interval.low, "high": interval.high}
    return list(xr.Dataset({**columns, **numbers}).to_dataframe().reset_index().to_dict("records"))


def _take_along_last(values: np.ndarray, index: np.ndarray) -> np.ndarray:
    """Return the value at an index of the last dimension. The index is clipped to its size."""
    indices = np.clip(index, 0, values.shape[-1] - 1)[..., None]
    return np.take_along_axis(values, indices, axis=-1)[..., 0]
