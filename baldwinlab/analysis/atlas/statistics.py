"""Statistics of the atlas: intervals of means over runs, and slopes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr
from scipy import stats

CONFIDENCE_LEVEL = 0.95
Floats = npt.NDArray[np.float64]


class MeanInterval(NamedTuple):
    """A mean over runs with its 95 % interval (Student's t).

    The interval is NaN for a single run. `runs` counts the defined values.
    """

    mean: float
    low: float
    high: float
    runs: int

    def __str__(self) -> str:
        if not self.runs:
            return "not defined"
        return f"{self.mean:.3g} [{self.low:.3g}, {self.high:.3g}]"


def estimate_mean(values: xr.DataArray | Floats) -> MeanInterval:
    """Return the mean of the defined values, with its interval.

    `values`: one value per run; NaN where undefined.
    """
    defined = np.asarray(values, np.float64).ravel()
    defined = defined[np.isfinite(defined)]
    if not defined.size:
        return MeanInterval(np.nan, np.nan, np.nan, 0)
    mean = float(defined.mean())
    if defined.size == 1:
        return MeanInterval(mean, np.nan, np.nan, 1)
    error = defined.std(ddof=1) / np.sqrt(defined.size)
    half = float(error * stats.t.ppf((1 + CONFIDENCE_LEVEL) / 2, defined.size - 1))
    return MeanInterval(mean, mean - half, mean + half, defined.size)


def estimate_slope(x: Floats, values: xr.DataArray, dim: str) -> MeanInterval:
    """Return the mean over runs of the least-squares slope of values on x.

    `values`: values (dim, run).
    """
    centered = xr.DataArray(x - x.mean(), dims=dim)
    slopes = (values.drop_vars(dim, errors="ignore") * centered).sum(dim, skipna=False)
    return estimate_mean(slopes / float((centered**2).sum()))


def is_equivalent(differences: xr.DataArray | Floats, bound: float) -> bool:
    """Return whether two one-sided t tests at 5 % show that the mean is within `bound` of 0."""
    defined = np.asarray(differences, np.float64).ravel()
    defined = defined[np.isfinite(defined)]
    if defined.size < 2:
        return False
    if not defined.any():
        return bound > 0
    tests = (
        stats.ttest_1samp(defined, bound, alternative="less"),
        stats.ttest_1samp(defined, -bound, alternative="greater"),
    )
    return all(float(test.pvalue) < 1 - CONFIDENCE_LEVEL for test in tests)
