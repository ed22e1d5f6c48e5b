"""Intervals, slopes and equivalence, compared with SciPy."""

import numpy as np
import pytest
import xarray as xr
from scipy import stats

from baldwinlab.analysis.atlas.tables import estimate_mean, estimate_slope, is_equivalent

VALUES = np.random.default_rng(0).normal(3, 1, 12)


def test_the_interval_is_that_of_students_t() -> None:
    interval = estimate_mean(np.append(VALUES, np.nan))
    expected = stats.ttest_1samp(VALUES, 0).confidence_interval()
    assert (interval.low, interval.high) == pytest.approx(tuple(expected))
    assert interval.runs == 12
    # One value has a mean without an interval and no value has neither.
    assert estimate_mean(np.array([2.0])).mean == 2
    assert np.isnan(estimate_mean(np.array([2.0])).low)
    assert estimate_mean(np.array([np.nan])).runs == 0
    # A mean without values is not defined.
    assert str(estimate_mean(np.array([np.nan, np.nan]))) == "not defined"


def test_the_slope_is_that_of_a_regression_of_each_run() -> None:
    x = np.array([0.0, 1.0, 3.0])
    values = np.random.default_rng(1).normal(size=(3, 5))
    expected = [stats.linregress(x, run).slope for run in values.T]
    slope = estimate_slope(x, xr.DataArray(values, dims=("a", "run")), "a")
    assert slope.mean == pytest.approx(np.mean(expected))


def test_equivalence_needs_a_mean_clearly_within_the_bound() -> None:
    assert [is_equivalent(VALUES, bound) for bound in (4.5, 3.0, 0.5)] == [True, False, False]
    # One run is never equivalent, and equal runs are.
    assert not is_equivalent(np.array([0.0]), 1)
    assert is_equivalent(np.zeros(5), 0.1)
