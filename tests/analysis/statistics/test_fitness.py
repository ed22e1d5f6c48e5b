"""Tests of fitness measures, on studies that are small enough to compute by hand."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from baldwinlab.analysis.report.data import find_typical_lives
from baldwinlab.analysis.statistics import fitness, intervals
from baldwinlab.analysis.statistics.fitness import summarize_conditions
from tests.analysis.results.studies import study

NAN = float("nan")


def make_dataset(food: list[list[list[list[float]]]]) -> xr.Dataset:
    """Return a dataset [condition, run, generation, agent] in which an item gives energy 2."""
    array = np.array(food, np.float64)
    dims = ("condition", "run", "generation", "agent")
    coords = {dim: range(size) for dim, size in zip(dims, array.shape, strict=True)}
    return xr.Dataset({"food_eaten": (dims, array), "energy": (dims, 2 * array)}, coords)


def test_best_and_mean_use_energy_and_share_counts_agents() -> None:
    dataset = make_dataset([[[[0, 1, 5], [0, 0, 0]]]])
    assert fitness.best(dataset).values.tolist() == [[[10, 0]]]
    assert fitness.mean(dataset).values.tolist() == [[[4, 0]]]
    np.testing.assert_allclose(fitness.share(dataset).values, [[[2 / 3, 0]]])
    assert fitness.largest_gain(dataset).values.tolist() == [[5]]
    dataset["food_eaten"] = dataset["food_eaten"].astype(np.int32)
    np.testing.assert_allclose(fitness.share(dataset).values, [[[2 / 3, 0]]])


def test_final_and_initial_average_over_their_window() -> None:
    dataset = make_dataset([[[[1], [2], [3], [4]]]])
    assert fitness.final(dataset, "mean", last=2).values.tolist() == [[7]]
    assert fitness.initial(dataset, "mean", first=2).values.tolist() == [[3]]
    for window in (fitness.final, fitness.initial):
        assert window(dataset, "mean", 99).values.tolist() == [[5]]
        with pytest.raises(ValueError, match="at least 1"):
            window(dataset, "mean", 0)
    # A shorter condition ends with its last generation.
    two = make_dataset([[[[1], [2], [3], [4]]], [[[5], [6], [NAN], [NAN]]]])
    assert fitness.final(two, "mean", last=1).values.tolist() == [[8], [12]]
    # Missing runs and agents stay missing.
    two = make_dataset([[[[1, NAN]], [[NAN, NAN]]]])
    for measure in fitness.MEASURES:
        comparison = fitness.final(two, measure).values[0]
        assert np.isfinite(comparison[0]) and np.isnan(comparison[1])


def test_the_summary_has_a_row_per_condition_with_runs_and_measure() -> None:
    rows = summarize_conditions(study({"one": [1, 2, 3, 4], "two": [NAN]}))
    assert [(row["condition"], row["measure"]) for row in rows] == [
        ("one", "best"),
        ("one", "mean"),
        ("one", "share"),
    ]
    expected = {"n": 4, "median": 2.5, "mean": 2.5, "lower_quartile": 1.75, "min": 1, "max": 4}
    assert {name: rows[0][name] for name in expected} == expected


def test_an_interval_of_nonnegative_values_ends_at_zero_and_of_a_share_at_one() -> None:
    average, low, high = intervals.interval_of_mean(xr.DataArray([0.0, 0, 30], dims="run"))
    assert (float(average), float(low)) == (10, 0) and high > 30
    _, low, _ = intervals.interval_of_mean(xr.DataArray([-1.0, 0, 30], dims="run"))
    assert low < 0
    ate = [[[1, 1, 1, 1], [1, 1, 1, 0]], [[1, 1, 1, 1], [1, 1, 1, 1]], [[1, 1, 0, 0], [1, 1, 1, 1]]]
    study = xr.Dataset({"energy": (("run", "generation", "agent"), np.asarray(ate, float))})
    for shares in (fitness.share(study), fitness.final(study, "share")):
        average, _, high = intervals.interval_of_mean(shares)
        assert (average < 1).all() and (high == 1).all()
    assert (intervals.interval_of_mean(fitness.mean(study))[2] > 1).all()


def test_the_interval_of_a_median_is_that_of_the_sign_test() -> None:
    middle, low, high = intervals.interval_of_median(
        xr.DataArray(np.arange(30.0)[::-1], dims="run")
    )
    # The tenth smallest and the tenth largest value.
    assert (float(middle), float(low), float(high)) == (14.5, 9, 20)
    _, low, high = intervals.interval_of_median(xr.DataArray([3.0, 1, 2, 5, 4, 6], dims="run"))
    assert (float(low), float(high)) == (1, 6)
    # The median of fewer than six values has no interval.
    values = xr.DataArray([[1.0, 2, 3, 4, 5, NAN], [1, 2, 3, 4, 5, 6]], dims=("generation", "run"))
    middle, low, high = intervals.interval_of_median(values)
    assert middle.values.tolist() == [3, 3.5]
    np.testing.assert_array_equal(low, [NAN, 1])
    np.testing.assert_array_equal(high, [NAN, 6])


def test_the_typical_run_is_nearest_to_the_median() -> None:
    assert fitness.typical_run(study({"evo": [9, 1, 5, 100, NAN]}), "evo") in (0, 2)
    with pytest.raises(ValueError, match="no run of evo"):
        fitness.typical_run(study({"evo": [NAN]}), "evo")


def test_the_typical_run_is_that_of_the_generations_which_the_report_averages() -> None:
    # (condition, run, generation, agent): the middle run differs at the end.
    two = make_dataset([[[[9], [0]], [[0], [1]], [[1], [2]]]]).assign_coords(condition=["evo"])
    assert [fitness.typical_run(two, "evo", last) for last in (1, 2)] == [1, 2]
    assert [find_typical_lives(two, last)["evo"].run for last in (1, 2)] == [1, 2]


def test_stored_curves_equal_computed_ones() -> None:
    two = make_dataset([[[[1, 4], [2, 2]]], [[[3, NAN], [NAN, NAN]]]])
    stored = fitness.cache_measures(two)
    for measure, compute in fitness.MEASURES.items():
        xr.testing.assert_equal(compute(stored), compute(two))
        assert (
            compute(stored.drop_dims("agent")).sel(condition=1).values.tolist()[0][0]
            == compute(two).values[1, 0, 0]
        ), measure


def test_a_table_of_intervals_keeps_the_factors_of_conditions() -> None:
    values = xr.DataArray(
        np.arange(24.0).reshape(2, 2, 6),
        dims=("condition", "generation", "run"),
        coords={"condition": ["evo/A", "evo/B"], "map": ("condition", ["A", "B"])},
    )
    interval = intervals.interval_of_median(values)
    rows = intervals.tabulate_interval(interval, mean=values.mean("run"))
    assert [(row["condition"], row["map"], row["generation"]) for row in rows] == [
        ("evo/A", "A", 0), ("evo/A", "A", 1), ("evo/B", "B", 0), ("evo/B", "B", 1),
    ]  # fmt: skip
    assert (
        [row["mean"] for row in rows] == [row["median"] for row in rows] == [2.5, 8.5, 14.5, 20.5]
    )
