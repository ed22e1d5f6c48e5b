"""Two samples of survival times compared. Some are censored: who is left alone alive lasts at least so long.

Sources: N. Mantel, Cancer Chemotherapy Reports 50 (1966), for the log-rank test; E. L. Kaplan and P. Meier, Journal of the
American Statistical Association 53 (1958), for the curve; P. Royston and M. K. B. Parmar, BMC Medical Research Methodology 13
(2013), for the restricted mean; E. A. Gehan, Biometrika 52 (1965), for pairs of which one is known to last longer.
"""

from __future__ import annotations

from math import inf, nan
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy import stats

from baldwinlab.statistics import RESAMPLES, SEED, Comparison, Sample, checked, percentiles

ROUNDING = 1e-9  # a share is a product of many


class Survival(NamedTuple):
    """How long each run lasts."""

    times: Sample  # [run], in any unit, above 0
    censored: npt.NDArray[np.bool_]  # [run]: true where it lasts longer, nobody knows how much

    @property
    def known_until(self) -> float:
        """Up to where its curve is known: for ever, where the last of all is seen to die."""
        last = float(self.times.max())
        return last if self.censored[self.times == last].any() else inf


def compare_survival(a: Survival, b: Survival) -> Comparison:
    """Log-rank test, difference of restricted means with its bootstrap interval, and A12.

    A restricted mean is the area under the Kaplan-Meier curve up to where both curves are known. Medians are those of the curves;
    NaN where more than half live on. U is the log-rank statistic, above 0 where a lasts longer. Pairs of which nobody knows which
    lasts longer count half in A12. The interval is NaN where a sample has a single member; p is 1 and U is 0 where no death tells
    them apart. Raises ValueError as `compare` does.
    """
    a, b = (Survival(checked(one.times), np.asarray(one.censored, np.bool_)) for one in (a, b))
    until = min(a.known_until, b.known_until, max(float(a.times.max()), float(b.times.max())))
    effect = float(restricted_mean(a, until) - restricted_mean(b, until))
    low, high = nan, nan
    if min(a.times.size, b.times.size) > 1:
        generator = np.random.default_rng(SEED)
        means = [
            restricted_mean(one, until, _resampled(one.times.size, generator)) for one in (a, b)
        ]
        low, high = percentiles(means[0] - means[1])
    a12 = (1 + float(_outlives(a, b).mean()) - float(_outlives(b, a).mean())) / 2
    return Comparison(
        a.times.size, b.times.size, median(a), median(b), effect, low, high, *log_rank(a, b), a12
    )


def log_rank(a: Survival, b: Survival) -> tuple[float, float]:
    """The statistic, standard normal where both die alike and above 0 where a dies later than b, and the two-sided p."""
    first, second = (stats.CensoredData.right_censored(*one) for one in (a, b))
    with np.errstate(invalid="ignore"):
        found = stats.logrank(first, second)
    return (0.0, 1.0) if np.isnan(found.pvalue) else (-float(found.statistic), float(found.pvalue))


def median(sample: Survival) -> float:
    """Where the Kaplan-Meier curve crosses 1/2; in the middle where it stays there for a while; NaN where it does not cross."""
    times, alive = _curve(sample, np.ones(sample.times.size))
    at_most, below = times[alive < 0.5 + ROUNDING], times[alive < 0.5 - ROUNDING]
    return float(at_most[0] + below[0]) / 2 if below.size else nan


def restricted_mean(
    sample: Survival, until: float, counts: npt.NDArray[np.int64] | None = None
) -> Sample:
    """The area under the Kaplan-Meier curve up to a time: of the sample, or of each run as often as `counts` [..., run] says."""
    times, alive = _curve(sample, np.ones(sample.times.size) if counts is None else counts)
    lasting = np.diff(np.minimum(times, until), prepend=0, append=until)
    return np.asarray(lasting[0] + alive @ lasting[1:], np.float64)


def _curve(sample: Survival, counts: npt.NDArray[np.generic]) -> tuple[Sample, Sample]:
    """Times in order, and the share [..., run] alive after each; who dies counts before who is censored at the same time."""
    order = np.lexsort((sample.censored, sample.times))
    at_risk = np.cumsum(counts[..., ::-1], axis=-1)[..., ::-1]
    dying = counts * ~sample.censored[order] / np.maximum(1, at_risk)
    return sample.times[order], np.cumprod(1 - dying, axis=-1)


def _resampled(size: int, generator: np.random.Generator) -> npt.NDArray[np.int64]:
    """How often each of `size` runs is drawn, [sample, run]; runs are alike, so the counts fit them in any order."""
    return generator.multinomial(size, np.full(size, 1 / size), RESAMPLES)


def _outlives(a: Survival, b: Survival) -> npt.NDArray[np.bool_]:
    """Which of a are known to outlive which of b, [a, b]."""
    longer = a.times[:, None] > b.times
    also = (a.times[:, None] == b.times) & a.censored[:, None]
    return np.asarray((longer | also) & ~b.censored, np.bool_)
