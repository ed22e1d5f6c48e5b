"""Proportions of runs, with exact intervals, and the hurdle model of a bimodal effect.

The hurdle model has the share of runs that take off, and the size given take-off.

References
----------
Hurdle model: J. G. Cragg, Econometrica 39 (1971).
"""

from __future__ import annotations

from math import nan
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy import stats

from baldwinlab.analysis.statistics.samples import Sample

CONFIDENCE_LEVEL = 0.95


def proportion_interval(successes: int, runs: int) -> tuple[float, float]:
    """Return the 95 % interval of a probability, by the method of Clopper and Pearson.

    The interval is exact: it contains the probability in at least 95 % of studies, for any number
    of runs.

    Parameters
    ----------
    successes
        Number of runs with the event.
    runs
        Number of runs, at least 1.

    Returns
    -------
    tuple of float
        Ends of the interval, in [0, 1].

    References
    ----------
    .. [1] C. J. Clopper and E. S. Pearson, "The use of confidence or fiducial limits illustrated in
       the case of the binomial", Biometrika 26 (1934).
    """
    test = stats.binomtest(successes, runs)
    low, high = test.proportion_ci(CONFIDENCE_LEVEL, method="exact")
    return float(low), float(high)


def estimate_probability(values: npt.NDArray[np.float64]) -> tuple[float, float, float]:
    """Return the share of runs with an event, and the ends of its interval.

    Parameters
    ----------
    values
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
    """Both parts of the hurdle model.

    Attributes
    ----------
    runs : int
        Number of runs.
    takeoffs : int
        Number of runs above the threshold.
    share_low, share_high : float
        95 % Clopper-Pearson interval of the probability of take-off.
    size : float
        Median over the runs that take off; NaN if there is none.
    """

    runs: int
    takeoffs: int
    share_low: float
    share_high: float
    size: float

    @property
    def is_bimodal(self) -> bool:
        """Whether some runs take off and others do not."""
        return 0 < self.takeoffs < self.runs


def measure_hurdle(values: Sample, threshold: float) -> Hurdle:
    """Divide runs by a threshold, and measure both parts of the hurdle model.

    A run takes off if its value is above the threshold.
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
