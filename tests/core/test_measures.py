"""Measures of runs that have different numbers of generations."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import xarray as xr

from baldwinlab.core.measures import measure_runs

LENGTHS = [4, 2, 6, 4]


@pytest.fixture(scope="module")
def runs() -> xr.Dataset:
    """Runs whose energy is 10 times the run plus the generation."""
    energy = 10.0 * np.arange(4)[:, None, None] + np.arange(6)[:, None] + np.zeros(3)
    dims = ("run", "generation", "agent")
    data = xr.Dataset({"energy": (dims, energy)}, {"run": [0, 1, 2, 3], "generation": range(6)})
    data = data.assign_coords(n_generations=("run", LENGTHS))
    return data.where(data["generation"] < data["n_generations"])


def read_last(runs: xr.Dataset) -> xr.DataArray:
    return runs["energy"].isel(generation=-1).mean("agent")


def average_second_half(runs: xr.Dataset) -> xr.DataArray:
    second_half = slice(runs.sizes["generation"] // 2, None)
    return runs["energy"].isel(generation=second_half).mean(("generation", "agent"))


def has_no_gap(runs: xr.Dataset) -> xr.DataArray:
    return runs["energy"].notnull().all(("generation", "agent"))


@pytest.mark.parametrize(
    ("function", "expected"),
    [
        (read_last, [3, 11, 25, 33]),
        (average_second_half, [2.5, 11, 24, 32.5]),
        (has_no_gap, [True] * 4),
    ],
)
def test_each_run_is_measured_up_to_its_own_last_generation(
    runs: xr.Dataset, function: Callable[[xr.Dataset], xr.DataArray], expected: list[float]
) -> None:
    values = measure_runs(function, runs)
    assert values["run"].values.tolist() == [0, 1, 2, 3]
    assert values.values.tolist() == expected


def test_runs_of_a_study_without_a_stop_are_measured_together(runs: xr.Dataset) -> None:
    complete = runs.drop_vars("n_generations").fillna(0)
    assert measure_runs(lambda runs: runs["run"] * 0 + runs.sizes["run"], complete).max() == 4


def test_a_condition_without_runs_has_no_values(runs: xr.Dataset) -> None:
    assert measure_runs(read_last, runs.isel(run=[])).size == 0
