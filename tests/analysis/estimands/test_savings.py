"""Learning times and savings."""

from __future__ import annotations

import numpy as np
import xarray as xr

from baldwinlab.analysis.estimands.traits import (
    find_learning_time,
    measure_foraging_times,
    measure_savings,
)

ENDS = xr.DataArray([250, 500, 600], dims="window")


def performances(*rows: list[float]) -> xr.DataArray:
    return xr.DataArray(np.array(rows, float), dims=("run", "window"))


def test_the_learning_time_is_the_first_window_with_90_percent_of_the_final_performance() -> None:
    times = find_learning_time(performances([1, 5, 10], [1, 9, 10], [9.5, 1, 10], [3, 2, 0]), ENDS)
    np.testing.assert_array_equal(times, [600, 500, 250, np.nan])


def test_foraging_times_compare_meal_rates_although_the_last_window_is_shorter() -> None:
    names = ["random genome", "generation 0", "generation 39"]
    # Items in windows of 250, 250 and 100 steps, of one run and one agent.
    eaten = np.array([[0, 0, 0], [0, 25, 40], [100, 100, 40]])
    data = xr.Dataset(
        {"eaten_in_window": (("newborns", "window", "run", "agent"), eaten[:, :, None, None])},
        {"newborns": names, "window": [0, 250, 500]},
    )
    times = measure_foraging_times(data, 600)
    assert times["generation"].values.tolist() == [0, 39]
    np.testing.assert_array_equal(times.transpose("run", "generation"), [[600, 250]])
    np.testing.assert_allclose(measure_savings(times, 10), [1 - 250 / 600])
