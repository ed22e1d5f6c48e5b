"""Hurdle model of a bimodal effect: the share of runs that take off, and the size given take-off.

References
----------
J. G. Cragg, Econometrica 39 (1971).
"""

from __future__ import annotations

from math import nan
from typing import NamedTuple

import numpy as np

from baldwinlab.analysis.statistics.proportions import proportion_interval
from baldwinlab.analysis.statistics.samples import Sample


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
