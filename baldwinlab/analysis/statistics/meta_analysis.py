"""Random-effects summary of the effects in several papers, with a prediction interval.

References
----------
Variance between papers: R. C. Paule and J. Mandel, Journal of Research of the National Bureau of
Standards 87 (1982).
Interval of the mean: J. Hartung and G. Knapp, Statistics in Medicine 20 (2001).
Prediction interval: J. P. T. Higgins, S. G. Thompson and D. J. Spiegelhalter, Journal of the Royal
Statistical Society A 172 (2009).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import stats

from baldwinlab.analysis.statistics.bootstrap import CONFIDENCE_LEVEL, Sample

# With fewer papers, the prediction interval is undefined.
MIN_PAPERS = 3


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
