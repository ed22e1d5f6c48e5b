"""Traits of runs, of which some stop early, and the fall of learning over the generations."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from baldwinlab.analysis.estimands.questions import estimate
from baldwinlab.analysis.estimands.traits import (
    find_learning_time,
    measure_foraging_times,
    measure_log_fall,
    select_innate_trait,
    split_ends,
)
from baldwinlab.papers.presets import load
from tests.analysis.estimands.conftest import Stored

DIMS = ("run", "generation", "agent")
ENDS = xr.DataArray([250, 500, 600], dims="window")


def distances(*by_run: list[float]) -> xr.DataArray:
    values = np.array(by_run)
    coords = {"generation": np.arange(values.shape[1])}
    return xr.DataArray(values, coords, dims=("run", "generation"))


def test_windows_are_means_and_do_not_overlap() -> None:
    first, final = split_ends(distances([1, 2, 3, 4, 5]), 10)
    assert first["generation"].values.tolist() == [0, 1]
    assert final["generation"].values.tolist() == [3, 4]


def test_a_fall_is_the_logarithm_of_the_ratio_of_both_windows() -> None:
    falls = measure_log_fall(distances([4, 3, 2, 1], [4, 4, 4, 4], [1, 1, 1, 4], [0] * 4), 1)
    np.testing.assert_allclose(falls, [np.log(4), 0, -np.log(4), np.nan])
    # A fall to 0 has no logarithm and counts as a fall to 1 %.
    assert measure_log_fall(distances([2, 0]), 1).item() == pytest.approx(np.log(100))


@pytest.mark.nightly
def test_assimilation_does_not_change_if_a_constant_is_added_to_fitness(
    stored: dict[str, Stored],
) -> None:
    data = stored["costly-climbing/rugged"]
    shifted = data.innate.assign(energy=data.innate["energy"] + 5)
    original, changed = (
        {
            row.question: row
            for row in estimate(
                data.runs,
                {"innate": innate, "assimilation": data.assimilation},
                data.experiment,
                5,
            )
        }
        for innate in (data.innate, shifted)
    )
    a, b = (rows["assimilation"].values for rows in (original, changed))
    assert a is not None
    xr.testing.assert_identical(a, b)


def test_assimilation_is_the_fall_in_learners_minus_that_in_their_control(
    stored: dict[str, Stored],
) -> None:
    data = stored["guessing"]
    rows = estimate(data.runs, {"assimilation": data.assimilation}, data.experiment, 2)
    (row,) = [row for row in rows if row.question == "assimilation"]
    assert row.trait == "share of alleles that are ?"
    unset = data.runs["unset"].mean("agent").astype(np.float64)
    first, final = unset[:, :2].mean("generation"), unset[:, -2:].mean("generation")
    learners, control = row.terms["learner"], row.terms["control"]
    assert learners.values == pytest.approx(np.log((first / final).values), rel=1e-5)
    assert list(row.terms) == ["learner", "control", "neutral"]
    assert row.values is not None
    assert row.values.values == pytest.approx((learners - control).values)


def test_a_stopped_run_has_the_trait_of_its_last_generation_as_in_the_assay() -> None:
    values = 10.0 * np.arange(2)[:, None, None] + np.arange(5)[:, None] + np.zeros(3)
    coordinates = {"run": [0, 1], "generation": range(5), "n_generations": ("run", [5, 3])}
    data = xr.Dataset({"ones": (DIMS, values), "unset": (DIMS, -values)}, coordinates)
    data = data.where(data["generation"] < data["n_generations"])
    innate = xr.Dataset(coords={"run": [0, 1], "generation": [0, 2, 4]})
    experiment = load("hinton-nowlan-1987:guessing")

    trait = select_innate_trait(data, innate, experiment).values
    assert trait.dims == DIMS and trait["generation"].values.tolist() == [0, 2, 4]
    assert trait.isel(agent=0).values.tolist() == [[0, 2, 4], [10, 12, 12]]


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
    np.testing.assert_allclose(measure_log_fall(times, 10), [np.log(600 / 250)])
