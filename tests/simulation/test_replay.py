"""A replay is the lifetime of a stored run, step by step."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from baldwinlab.core.variables import TRACE_VARIABLES
from baldwinlab.simulation.replay import replay
from baldwinlab.simulation.simulate import simulate
from tests.small_studies import shorten_preset


def test_a_trace_contains_the_declared_variables() -> None:
    trace = replay(shorten_preset(), seed=1)
    assert {*trace.data_vars, "action"} == set(TRACE_VARIABLES)
    for name, variable in TRACE_VARIABLES.items():
        assert trace[name].dims == variable.dims
        assert trace[name].dtype == variable.dtype
    assert trace.sizes["step"] == 300
    assert set(np.unique(trace.heading % 9)) == {0}


def test_a_trace_is_read_from_netcdf_unchanged(tmp_path: Path) -> None:
    trace = replay(shorten_preset(), seed=1)
    trace.to_netcdf(tmp_path / "trace.nc")
    with xr.open_dataset(tmp_path / "trace.nc") as stored:
        xr.testing.assert_identical(stored.load(), trace)


def test_the_energy_of_a_larger_population_in_the_dataset_has_no_effect() -> None:
    experiment = shorten_preset("evo/A")
    energy = simulate(experiment, seed=1).energy
    padded = energy.pad(agent=(0, 2))
    expected = replay(experiment, seed=1, generation=1, energy=energy)
    xr.testing.assert_identical(replay(experiment, seed=1, generation=1, energy=padded), expected)


@pytest.mark.parametrize("generation", [-1, 3])
def test_a_generation_out_of_range_is_refused(generation: int) -> None:
    with pytest.raises(
        ValueError, match=f"generation = {generation} must be a whole number from 0 to 2"
    ):
        replay(shorten_preset(), seed=1, generation=generation)
