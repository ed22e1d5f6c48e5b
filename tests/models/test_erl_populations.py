"""Test populations without generations: records, measures and settings."""

from __future__ import annotations

import numpy as np
import xarray as xr

import baldwinlab as bl
from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import assign
from baldwinlab.models.erl_populations import ErlPopulations
from tests.models.erl_worlds import SETTINGS, SMALL
from tests.models.runs import simulate_runs


def test_measures_equal_the_records() -> None:
    small = assign(bl.load("erl-populations"), [*SETTINGS, "erl_populations.max_steps=50"])
    run = bl.simulate(small, seed=4).expand_dims("run")
    measured = {
        name: xr.DataArray(measure.of(run)).item()
        for name, measure in ErlPopulations.measures.items()
    }
    assert measured == {
        "survived": run.energy.item(), "extinct": run.extinct.item(),
        "born": run.born.item(), "living": run.living.item(),
    }  # fmt: skip


def test_populations_of_the_same_founders_have_different_histories() -> None:
    model = ErlPopulations(**SMALL, max_steps=100)
    founders = np.tile(model.founders(1, GenerationKey(4, 0, 0)), (2, 1, 1))
    n_agents = model.simulate(4, [0], 0, founders[None]).records["living"]
    assert n_agents[0, 0] != n_agents[0, 1]


def test_the_settings_for_checks_have_births_and_deaths() -> None:
    model = ErlPopulations(**ErlPopulations.check_settings)
    results = model.simulate(
        11, [0, 1], 0, np.stack([model.founders(5, GenerationKey(11, run, 0)) for run in (0, 1)])
    )
    assert results.records["born"].min() > 0 and 0 < results.records["extinct"].sum() < 10
    assert ((results.records["living"] > 1) & (results.records["living"] < model.max_agents)).all()


def test_a_longer_run_has_the_same_beginning_and_surviving_populations_are_censored() -> None:
    ends = {}
    for steps in (200, 400):
        small = assign(
            bl.load("erl-populations"), [*SETTINGS, f"erl_populations.max_steps={steps}"]
        )
        ends[steps] = simulate_runs(small, 4, 6)
    shorter, longer = (ends[steps].energy.values.ravel() for steps in (200, 400))
    assert longer.min() < 200 < longer.max()
    np.testing.assert_array_equal(shorter, np.minimum(longer, 200))
    censored = ErlPopulations.measures["survived"].censored
    assert censored is not None
    np.testing.assert_array_equal(censored(ends[400]), longer == 400)
