"""Time series within a lifetime add up to the totals of the lifetime."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from baldwinlab.experiment import Experiment
from baldwinlab.simulation.history import Histories
from baldwinlab.simulation.records import make_record, make_run_dataset
from baldwinlab.simulation.simulate import continue_histories, simulate, simulate_histories
from baldwinlab.studies.open import open_runs
from tests.small_studies import make_small_study, shorten_preset

BIRTHS = {
    "features": ["births-and-deaths"],
    "births_and_deaths": {"max_age": 60},
    "start": {"x": 400, "y": 160},
}


def series_experiment(every: int = 70) -> Experiment:
    return shorten_preset().replace(record={"every": every})


@pytest.mark.parametrize("every", [1, 70, 300, 1000])
def test_windows_add_up_to_the_energy_of_all_agents(every: int) -> None:
    run = simulate(series_experiment(every), seed=2)
    assert run["energy_gained"].dims == ("generation", "window")
    assert run["window"].values.tolist() == list(range(0, 300, every))
    assert np.allclose(run["energy_gained"].sum("window"), run["energy"].sum("agent"))
    assert (run["agents_alive"] == 20).all()
    assert (run["births"] == 0).all()


def test_time_series_change_nothing_else() -> None:
    with_series = simulate(series_experiment(), seed=2)
    without_series = simulate(shorten_preset(), seed=2)
    for name in without_series.data_vars:
        assert with_series[name].identical(without_series[name])


def test_a_window_has_the_energy_of_a_lifetime_of_its_steps() -> None:
    first_window = simulate(series_experiment(70), seed=2)["energy_gained"].values[0, 0]
    short_life = shorten_preset().replace(lifetime={"steps": 70})
    assert first_window == simulate(short_life, seed=2)["energy"].values[0].sum()


@pytest.mark.nightly
def test_windows_add_up_to_the_births_of_all_agents() -> None:
    run = simulate(series_experiment().replace(world=BIRTHS), seed=2)
    assert run["births"].sum() > 0
    assert np.array_equal(run["births"].sum("window"), run["born"].sum("agent"))


def test_time_series_of_several_lifetimes_are_means_that_add_up_to_the_mean_energy() -> None:
    several = series_experiment().replace(lifetime={"repeats": 3}, population={"worlds": 4})
    run = simulate(several, seed=2)
    assert np.allclose(run["energy_gained"].sum("window"), run["energy"].sum("agent"))
    assert np.array_equal(run["agents_alive"], np.full((3, 5), 20))


def test_a_study_stores_time_series_and_opens_them_with_the_dimension_run(tmp_path: Path) -> None:
    conditions = [series_experiment().replace(name="windows"), shorten_preset("evo/A")]
    make_small_study(tmp_path / "study", conditions, runs=2)
    data = open_runs(tmp_path / "study")
    assert data["energy_gained"].dims == ("condition", "run", "generation", "window")
    assert data["window"].attrs["long_name"] == "first step of the window"
    with_windows = data.sel(condition="windows")
    assert np.allclose(
        with_windows["energy_gained"].sum("window"), with_windows.energy.sum("agent")
    )
    assert data["energy_gained"].sel(condition="evo/A").isnull().all()


def test_an_extended_run_with_time_series_has_the_bits_of_a_long_run() -> None:
    several = series_experiment().replace(lifetime={"repeats": 2}, population={"worlds": 4})
    (stored,) = simulate_histories(several.replace(evolution={"generations": 2}), 2, [1])
    extended = Histories(several, 2, [1], [make_record(stored)])
    continue_histories(extended)
    (long,) = simulate_histories(several, 2, [1])
    assert make_run_dataset(extended.histories[0]).identical(make_run_dataset(long))
