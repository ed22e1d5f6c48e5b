"""Tests of the random-effects summary against published results and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from baldwinlab.analysis.statistics.meta_analysis import combine_papers

# Thirteen trials of a vaccine: tuberculosis and no tuberculosis with and without vaccination.
# G. A. Colditz and others, Journal of the American Medical Association 271 (1994).
VACCINATED = np.array([
    [4, 119], [6, 300], [3, 228], [62, 13536], [33, 5036], [180, 1361], [8, 2537],
    [505, 87886], [29, 7470], [17, 1699], [186, 50448], [5, 2493], [27, 16886],
])  # fmt: skip
CONTROLS = np.array([
    [11, 128], [29, 274], [11, 209], [248, 12619], [47, 5761], [372, 1079], [10, 619],
    [499, 87892], [45, 7232], [65, 1600], [141, 27197], [3, 2338], [29, 17825],
])  # fmt: skip


def test_the_summary_of_thirteen_trials_is_that_of_metafor() -> None:
    """Compare with `rma(method="PM", test="knha")` of the R package metafor.

    tau^2 = 0.3181, mean = -0.7150, standard error = 0.1809.
    """
    treated, control = VACCINATED.sum(axis=1), CONTROLS.sum(axis=1)
    effects = np.log(VACCINATED[:, 0] / treated) - np.log(CONTROLS[:, 0] / control)
    variances = 1 / VACCINATED[:, 0] - 1 / treated + 1 / CONTROLS[:, 0] - 1 / control
    summary = combine_papers(effects, np.sqrt(variances))
    assert summary.spread**2 == pytest.approx(0.3181, abs=1e-4)
    assert summary.mean == pytest.approx(-0.7150, abs=1e-4)
    assert summary.high - summary.mean == pytest.approx(stats.t.ppf(0.975, 12) * 0.1809, abs=1e-3)


def test_with_equal_precision_the_interval_is_that_of_students_t() -> None:
    effects = np.array([0.2, 0.9, -0.4, 1.3, 0.6])
    summary = combine_papers(effects, np.full(5, 0.1))
    expected = stats.ttest_1samp(effects, 0).confidence_interval(0.95)
    assert (summary.low, summary.high) == pytest.approx((expected.low, expected.high))
    # The estimating equation of Paule and Mandel for equal precision.
    assert summary.spread**2 == pytest.approx(effects.var(ddof=1) - 0.1**2, abs=1e-4)
    # Equal effects have no spread.
    summary = combine_papers(np.full(4, 0.3), np.array([0.1, 0.2, 0.1, 0.3]))
    assert summary.spread == 0
    assert summary.low == pytest.approx(0.3) and summary.prediction_high == pytest.approx(0.3)


@pytest.mark.nightly
def test_the_prediction_interval_contains_nineteen_of_twenty_new_papers() -> None:
    generator = np.random.default_rng(7)
    hits = 0
    for _ in range(1000):
        errors = generator.uniform(0.05, 0.3, 10)
        true_effects = generator.normal(0.5, 0.4, 11)
        summary = combine_papers(true_effects[:10] + generator.normal(0, errors), errors)
        hits += summary.prediction_low < true_effects[10] < summary.prediction_high
    assert 0.92 < hits / 1000 < 0.98
