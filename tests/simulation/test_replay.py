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


@pytest.mark.parametrize("condition", ["evo/A", "evo+self-taught/A", "self-taught/A"])
def test_a_trace_is_identical_to_its_run(condition: str) -> None:
    experiment = shorten_preset(condition)
    run = simulate(experiment, seed=9, run=4)
    for generation in range(3):
        trace = replay(experiment, seed=9, run=4, generation=generation)
        assert np.array_equal(trace.eaten.sum("step"), run.food_eaten[generation])
        assert np.array_equal(trace.weight_birth, run.genome[generation])
        xr.testing.assert_identical(
            trace, replay(experiment, seed=9, run=4, generation=generation, energy=run.energy)
        )
    assert run.food_eaten.sum() > 0


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


def test_learning_changes_only_the_weights_of_the_action_module() -> None:
    learner = replay(shorten_preset(), seed=1)
    changed = (learner.weight_birth != learner.weight_death).any(("agent", "weight"))
    assert changed.sel(module="action")
    assert not changed.sel(module="reinforcement")
    without_learning = replay(shorten_preset("evo/A"), seed=1)
    assert (without_learning.weight_birth == without_learning.weight_death).all()


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
