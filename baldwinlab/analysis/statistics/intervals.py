"""Intervals of curves, of proportions of runs and of several papers, and the hurdle model.

The hurdle model of a bimodal effect has two parts: the fraction of runs that take off (the value
exceeds a threshold), and the median value of these runs.

References
----------
Hurdle model: J. G. Cragg, Econometrica 39 (1971).
Variance between papers: R. C. Paule and J. Mandel, Journal of Research of the National Bureau of
Standards 87 (1982).
Interval of the mean of papers: J. Hartung and G. Knapp, Statistics in Medicine 20 (2001).
Prediction interval: J. P. T. Higgins, S. G. Thompson and D. J. Spiegelhalter, Journal of the Royal
Statistical Society A 172 (2009).
"""

from __future__ import annotations

from math import nan
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr
from scipy import stats

from baldwinlab.analysis.statistics.bootstrap import CONFIDENCE_LEVEL, Sample
from baldwinlab.analysis.statistics.hypothesis_tests import find_interval_rank

# Probability of the upper end of a 95 % interval.
HIGH_QUANTILE = 0.975
# With fewer papers, the prediction interval is undefined.
MIN_PAPERS = 3


class CurveInterval(NamedTuple):
    """A mean or a median over runs, and its 95 % interval, NaN for small samples."""

    center: xr.DataArray
    low: xr.DataArray
    high: xr.DataArray


def interval_of_mean(values: xr.DataArray, over: str = "run") -> CurveInterval:
    """Compute the mean, and the 95 % interval by Student's t, which is NaN for a single value.

    If no value is negative, the interval is cut off at 0. It is also cut off at the attribute
    `valid_max` of the values, which is 1 for fractions. Neither cut changes the coverage.
    """
    count = values.count(over)
    average = values.mean(over)
    variance = ((values - average) ** 2).sum(over) / (count - 1).where(count > 1)
    quantiles = stats.t.ppf(HIGH_QUANTILE, np.maximum(count - 1, 1))  # NumPy, without labels.
    half_width = np.sqrt(variance / count) * xr.zeros_like(average).copy(data=quantiles)
    low = average - half_width
    if not bool((values < 0).any()):
        low = low.clip(min=0)
    high = (average + half_width).clip(max=values.attrs.get("valid_max"))
    return CurveInterval(average, low, high)


def interval_of_median(values: xr.DataArray, over: str = "run") -> CurveInterval:
    """Compute the median, and the 95 % interval by the sign test, which is NaN below six values.

    The interval is valid for any distribution. It reaches from the k-th smallest to the k-th
    largest value, where k is the 2.5 % quantile of the binomial distribution with probability 1/2
    (W. R. Thompson, Annals of Mathematical Statistics 7, 1936).
    """
    count = values.count(over)
    # NaN is sorted to the end.
    ordered = np.sort(values.transpose(..., over).values, axis=-1)
    # The number k of the docstring. If k is 0, there is no interval.
    rank = find_interval_rank(count.values)
    has_interval = rank > 0
    low = np.where(has_interval, _take_along_last(ordered, rank - 1), np.nan)
    high = np.where(has_interval, _take_along_last(ordered, count.values - rank), np.nan)
    return CurveInterval(values.median(over), count.copy(data=low), count.copy(data=high))


def tabulate_interval(
    interval: CurveInterval, center: str = "median", **columns: xr.DataArray
) -> list[dict[str, Any]]:
    """Return the rows of a table: coordinates, `columns`, the center, and the ends low and high."""
    numbers = {center: interval.center, "low": interval.low, "high": interval.high}
    return list(xr.Dataset({**columns, **numbers}).to_dataframe().reset_index().to_dict("records"))


def _take_along_last(values: np.ndarray, index: np.ndarray) -> np.ndarray:
    """Return the value at an index of the last dimension. The index is clipped to its size."""
    indices = np.clip(index, 0, values.shape[-1] - 1)[..., None]
    return np.take_along_axis(values, indices, axis=-1)[..., 0]


def proportion_interval(successes: int, runs: int) -> tuple[float, float]:
    """Return the 95 % interval of a probability, by the method of Clopper and Pearson.

    The interval is exact: it contains the probability in at least 95 % of studies, for any number
    of runs. `successes` is the number of runs with the event, and `runs` is at least 1.

    >>> low, high = proportion_interval(8, 10)
    >>> round(low, 2), round(high, 2)
    (0.44, 0.97)

    References
    ----------
    .. [1] C. J. Clopper and E. S. Pearson, "The use of confidence or fiducial limits illustrated in
       the case of the binomial", Biometrika 26 (1934).
    """
    test = stats.binomtest(successes, runs)
    low, high = test.proportion_ci(CONFIDENCE_LEVEL, method="exact")
    return float(low), float(high)


def estimate_probability(values: npt.NDArray[np.float64]) -> tuple[float, float, float]:
    """Return the fraction of runs with an event, and the ends of its 95 % interval.

    Parameters
    ----------
    values : np.ndarray
        1 for each run with the event and 0 for each run without it.

    Raises
    ------
    ValueError
        A value is neither 0 nor 1.
    """
    if not np.isin(values, (0.0, 1.0)).all():
        raise ValueError("the measure of a probability must be 0 or 1 in every run")
    successes = int(values.sum())
    low, high = proportion_interval(successes, values.size)
    return successes / values.size, low, high


class Hurdle(NamedTuple):
    """Both parts of the hurdle model."""

    runs: int
    takeoffs: int  # Number of runs above the threshold.
    # 95 % Clopper-Pearson interval of the probability of take-off.
    share_low: float
    share_high: float
    size: float  # Median over the runs that take off; NaN if there is none.

    @property
    def is_bimodal(self) -> bool:
        """Whether some runs take off and others do not."""
        return 0 < self.takeoffs < self.runs


def measure_hurdle(values: Sample, threshold: float) -> Hurdle:
    """Measure both parts of the hurdle model. A run takes off above the threshold.

    >>> hurdle = measure_hurdle(np.array([0.0, 0.0, 5.0, 7.0]), threshold=1)
    >>> hurdle.takeoffs, hurdle.size, hurdle.is_bimodal
    (2, 6.0, True)
    """
    sizes = values[values > threshold]
    share_low, share_high = proportion_interval(sizes.size, values.size)
    size = float(np.median(sizes)) if sizes.size else nan
    return Hurdle(
        runs=values.size,
        takeoffs=sizes.size,
        share_low=share_low,
        share_high=share_high,
        size=size,
    )


class RandomEffects(NamedTuple):
    """Summary of the effects in several papers."""

    papers: int
    mean: float  # Mean effect of all papers that could be studied in the same way.
    # 95 % interval of the mean.
    low: float
    high: float
    # 95 % interval of the effect in another paper.
    prediction_low: float
    prediction_high: float
    spread: float  # Standard deviation of the true effects between papers.


def combine_papers(effects: Sample, standard_errors: Sample) -> RandomEffects:
    """Combine the effects [paper] of at least `MIN_PAPERS` papers by a random-effects model."""
    # The import takes seconds.
    from statsmodels.stats.meta_analysis import combine_effects

    # Fields that are not used here divide by 0 if the papers have no spread.
    with np.errstate(divide="ignore", invalid="ignore"):
        model = combine_effects(effects, standard_errors**2, method_re="pm")
    mean = float(model.mean_effect_re)
    variance = float(model.var_hksj_re)  # Of the mean, by Hartung and Knapp.
    tail = (1 + CONFIDENCE_LEVEL) / 2
    margin = float(stats.t.ppf(tail, effects.size - 1)) * np.sqrt(variance)
    deviation = np.sqrt(float(model.tau2) + variance)  # tau2: variance between papers.
    prediction_margin = float(stats.t.ppf(tail, effects.size - 2)) * deviation
    return RandomEffects(
        papers=effects.size,
        mean=mean,
        low=float(mean - margin),
        high=float(mean + margin),
        prediction_low=float(mean - prediction_margin),
        prediction_high=float(mean + prediction_margin),
        spread=float(np.sqrt(model.tau2)),
    )
