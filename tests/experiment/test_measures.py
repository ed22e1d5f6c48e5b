"""Measures of runs with different numbers of generations, and with several species."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import xarray as xr

import baldwinlab as bl
from baldwinlab.core.variables import GENERATION_COUNT
from baldwinlab.experiment.measures import SPECIES_MEASURES, make_predation_measures, measure_runs

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


# [run, generation, agent]; the last run ends one generation earlier.
SPECIES = [
    [[0, 1, 1], [0, 0, 1], [0, 0, 0]],
    [[0, 1, 1], [1, 1, 1], [1, 1, 1]],
    [[0, 1, 1], [0, 1, 1], [0, 0, 1]],
    [[0, 1, 1], [0, 0, 0], [np.nan] * 3],
]
RUNS = xr.Dataset(
    {"species": (("run", "generation", "agent"), np.array(SPECIES, float))},
    {"run": range(4), "generation": range(3), GENERATION_COUNT: ("run", [3, 3, 3, 2])},
)


def measure(name: str) -> list[float]:
    values = measure_runs(SPECIES_MEASURES[name].of, RUNS)
    assert values.dims == ("run",)
    return list(values.values.tolist())


def test_fixation_is_that_of_the_first_species() -> None:
    assert measure("fixation") == [1, 0, 0, 1]


def test_a_run_with_two_species_at_its_end_is_unresolved() -> None:
    assert measure("unresolved") == [0, 0, 1, 0]


def test_fixation_and_loss_have_a_generation() -> None:
    np.testing.assert_array_equal(measure("fixation-or-loss"), [2, 1, np.nan, 1])


def test_experiments_with_species_have_these_measures() -> None:
    species = [{"name": "a", "size": 10}, {"name": "b", "size": 10}]
    foragers = bl.load("evo/A")
    assert foragers.measures == {}
    assert foragers.replace(population={"species": species}).measures == SPECIES_MEASURES
    needle = bl.load("hinton-nowlan-1987:guessing")
    assert "fixation" not in (needle.measures or {})
    mixed = needle.replace(population={"size": 20, "species": species})
    assert mixed.measures == {**(needle.measures or {}), **SPECIES_MEASURES}


def test_measures_average_the_agents_of_a_species_over_the_last_ten_generations() -> None:
    dims = ("run", "generation", "agent")
    energy = np.zeros((1, 12, 3))
    energy[0, 2:, 0] = 4.0
    energy[0, :2] = 100.0
    energy[0, 2:, 1:] = 1.0
    alive = np.zeros((1, 12, 3))
    alive[0, 7:, 1:] = 1
    species = np.broadcast_to([0, 1, 1], (1, 12, 3))
    runs = xr.Dataset(
        {"energy": (dims, energy), "alive": (dims, alive), "species": (dims, species)}
    )
    measures = make_predation_measures(["predators", "prey"], ["prey"])
    assert set(measures) == {"predators-fitness", "prey-fitness", "prey-survival"}
    assert measures["predators-fitness"].of(runs).item() == 4.0
    assert measures["prey-fitness"].of(runs).item() == 1.0
    assert measures["prey-survival"].of(runs).item() == 0.5
