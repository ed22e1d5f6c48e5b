"""Samples: their values, size, location and spread."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

Sample = np.ndarray[Any, np.dtype[np.float64]]


class Summary(NamedTuple):
    """Size, location and spread of a sample.

    Attributes
    ----------
    n : int
        Number of values.
    median, mean : float
        Median and mean.
    lower_quartile, upper_quartile : float
        Quartiles, linearly interpolated.
    min, max : float
        Smallest and largest value.
    """

    n: int
    median: float
    mean: float
    lower_quartile: float
    upper_quartile: float
    min: float
    max: float


def summarize(values: Sequence[float] | Sample) -> Summary:
    """Compute size, location and spread of a sample.

    Parameters
    ----------
    values
        Finite values, at least one.

    Returns
    -------
    Summary
        The summary.

    Raises
    ------
    ValueError
        If there is no value, or if a value is not finite.
    """
    values = check_sample(values)
    lower, median, upper = (float(quartile) for quartile in np.quantile(values, [0.25, 0.5, 0.75]))
    return Summary(
        n=values.size,
        median=median,
        mean=float(values.mean()),
        lower_quartile=lower,
        upper_quartile=upper,
        min=float(values.min()),
        max=float(values.max()),
    )


def check_sample(values: Sequence[float] | Sample) -> Sample:
    """Return the values as a flat float64 array.

    Parameters
    ----------
    values
        Finite values, at least one, of any shape.

    Returns
    -------
    Sample
        The values, [value].

    Raises
    ------
    ValueError
        If there is no value, or if a value is not finite.
    """
    sample = np.asarray(values, np.float64).ravel()
    if sample.size == 0 or not np.isfinite(sample).all():
        raise ValueError("a sample needs at least one value, and all finite")
    return sample
