"""Tests of the hurdle model against hand-made runs and the exact binomial interval."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from baldwinlab.analysis.statistics.intervals import measure_hurdle


def test_size_is_that_of_runs_above_the_threshold() -> None:
    hurdle = measure_hurdle(np.array([0.0, 0.0, 0.01, 5.0, 6.0, 7.0]), 0.05)
    assert (hurdle.takeoffs, hurdle.runs, hurdle.size) == (3, 6, 6.0)
    assert hurdle.is_bimodal
    # The interval of the share has tails of two and a half percent.
    hurdle = measure_hurdle(np.array([0.0] * 8 + [1.0] * 4), 0.5)
    assert stats.binom.sf(3, 12, hurdle.share_low) == pytest.approx(0.025)
    assert stats.binom.cdf(4, 12, hurdle.share_high) == pytest.approx(0.025)
    # Without takeoff the size is undefined.
    hurdle = measure_hurdle(np.zeros(10), 0.0)
    assert hurdle.takeoffs == 0 and np.isnan(hurdle.size) and not hurdle.is_bimodal
    # The interval of 0 of 10 ends at 1 - 0.025 ** (1 / 10).
    assert hurdle.share_high == pytest.approx(1 - 0.025**0.1)
