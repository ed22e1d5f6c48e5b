"""Measures of runs with several species, computed from small arrays."""

from __future__ import annotations

import numpy as np
import xarray as xr

import baldwinlab as bl
from baldwinlab.core.measures import measure_runs
from baldwinlab.core.variables import GENERATION_COUNT
from baldwinlab.experiment.species_measures import SPECIES_MEASURES

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
