"""Proportions of runs, with exact binomial intervals."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy import stats

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
