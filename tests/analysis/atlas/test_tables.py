"""Intervals, slopes and equivalence, compared with SciPy."""

import numpy as np
import pytest
import xarray as xr
from scipy import stats

from baldwinlab.analysis.atlas.tables import (
    estimate_correlation,
    estimate_mean,
    estimate_slope,
    format_fall,
    is_equivalent,
    pool_cells,
)

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


def make_table(generator: np.random.Generator, of_cells: float, of_runs: float) -> xr.DataArray:
    """Return values (cell, run) with the mean 1, and effects of cells and runs of these sizes."""
    cells, runs = 6, 10
    values = (
        1
        + of_cells * generator.normal(size=(cells, 1))
        + of_runs * generator.normal(size=(1, runs))
        + generator.normal(size=(cells, runs))
    )
    return xr.DataArray(values, dims=("a", "run"))


def test_equal_runs_give_the_interval_of_student_for_the_means_of_cells() -> None:
    means = VALUES[:6]
    table = xr.DataArray(np.tile(means[:, None], 8), dims=("a", "run"))
    expected = stats.ttest_1samp(means, 0).confidence_interval()
    pooled = pool_cells(table)
    assert pooled.mean == pytest.approx(means.mean())
    assert (pooled.low, pooled.high) == pytest.approx(tuple(expected))
    assert pooled.runs == 8
    # Equal cells give that for the means of the runs.
    assert pool_cells(table.rename(a="run", run="a"))[:3] == pytest.approx(pooled[:3])


@pytest.mark.parametrize(("of_cells", "of_runs"), [(0, 0), (1, 0), (0, 1), (1, 1)])
def test_the_interval_of_a_pooled_mean_is_wide_enough(of_cells: float, of_runs: float) -> None:
    generator = np.random.default_rng(1)
    intervals = [pool_cells(make_table(generator, of_cells, of_runs)) for _ in range(500)]
    share = np.mean([interval.low <= 1 <= interval.high for interval in intervals])
    assert share >= 0.93


def test_cells_without_a_value_are_left_out() -> None:
    table = make_table(np.random.default_rng(2), 1, 1)
    incomplete = table.copy()
    incomplete[2, 3] = np.nan
    assert pool_cells(incomplete) == pool_cells(table.drop_isel(a=2))
    # A single cell has a mean without an interval, and equal values have no width.
    assert np.isnan(pool_cells(table.isel(a=[0])).low)
    assert pool_cells(table * 0) == (0, 0, 0, 10)


def test_rank_correlations_have_the_intervals_of_fieller_hartley_and_pearson() -> None:
    x, y = np.arange(9.0), np.array([2.0, 1, 4, 3, 6, 5, 8, 7, 9])
    for estimate, expected, error in (
        (
            estimate_correlation(x, y, "spearman"),
            stats.spearmanr(x, y).statistic,
            np.sqrt(1.06 / 6),
        ),
        (
            estimate_correlation(x, y, "kendall"),
            stats.kendalltau(x, y).statistic,
            np.sqrt(0.437 / 5),
        ),
    ):
        assert estimate.mean == pytest.approx(expected)
        ends = np.tanh(np.arctanh(expected) + np.array([-1, 1]) * 1.959964 * error)
        assert (estimate.low, estimate.high) == pytest.approx(tuple(ends))
    # Equal orders have an interval that ends at 1, and few cells have none.
    assert estimate_correlation(x, x, "kendall").high == pytest.approx(1)
    assert np.isnan(estimate_correlation(x[:4], y[:4], "kendall").low)


def test_a_fall_is_printed_as_a_percentage() -> None:
    assert [format_fall(fall) for fall in (np.log(2), -np.log(2), np.nan)] == [
        "+50 %",
        "-100 %",
        "–",
    ]
