"""A trace is the lifetime of a stored run, step by step, also with several species."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import baldwinlab as bl
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.variables import TRACE_VARIABLES, trace_variables
from baldwinlab.experiment import Experiment
from baldwinlab.simulation.memory import dimension_sizes
from baldwinlab.simulation.replay import replay, replay_genomes
from baldwinlab.simulation.simulate import simulate
from tests.small_studies import shorten_preset
from tests.worlds import N_PREDATORS, N_PREY, PREY_ENERGY, make_predation


def test_a_trace_contains_the_declared_variables() -> None:
    trace = replay(shorten_preset(), seed=1)
    assert {*trace.data_vars, "action"} == set(TRACE_VARIABLES)
    for name, variable in TRACE_VARIABLES.items():
        assert trace[name].dims == variable.dims
        assert trace[name].dtype == variable.dtype
    assert trace.sizes["step"] == 300
    assert set(np.unique(trace.heading % 9)) == {0}


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


SEED = 5
GENERATION = 2
PREDATORS = slice(N_PREDATORS)
PREY = slice(N_PREDATORS, None)


@pytest.fixture(scope="module")
def predation() -> Experiment:
    return make_predation(evolution={"generations": 3}, motor={"noise": 0.1})


@pytest.fixture(scope="module")
def run(predation: Experiment) -> xr.Dataset:
    return bl.simulate(predation, seed=SEED, run=1).isel(generation=GENERATION)


@pytest.fixture(scope="module")
def trace(predation: Experiment) -> xr.Dataset:
    return bl.replay(predation, seed=SEED, run=1, generation=GENERATION)


def test_a_trace_of_species_is_identical_to_its_run(trace: xr.Dataset, run: xr.Dataset) -> None:
    prey_eaten = trace["prey_eaten"].sum("step").values
    items_eaten = trace["eaten"].sum("step").values - prey_eaten
    np.testing.assert_array_equal(items_eaten, run["food_eaten"])
    np.testing.assert_array_equal(prey_eaten, run["prey_eaten"])
    np.testing.assert_array_equal(items_eaten + PREY_ENERGY * prey_eaten, run["energy"])
    np.testing.assert_array_equal(trace["weight_birth"], run["genome"])
    np.testing.assert_array_equal(trace["alive"].sum("step"), run["age"])
    assert prey_eaten.sum() > 0
    assert items_eaten.sum() > 0


def test_a_trace_of_species_has_the_species_of_each_agent(trace: xr.Dataset) -> None:
    assert trace["species"].dims == ("agent",)
    assert trace["species"].dtype.kind == "i"
    assert trace["species"].values.tolist() == [0] * N_PREDATORS + [1] * N_PREY
    assert trace.attrs["species_names"] == "predators, prey"


def test_a_trace_of_species_has_the_declared_variables(
    trace: xr.Dataset, predation: Experiment
) -> None:
    declared = trace_variables(predation)
    sizes = dimension_sizes(predation)
    assert {*trace.data_vars, "action"} == set(declared)
    for name, variable in declared.items():
        assert trace[name].dims == variable.dims
        assert trace[name].dtype == variable.dtype
        assert trace[name].shape == tuple(sizes[dim] for dim in variable.dims)


def test_a_species_has_nan_for_the_inputs_of_other_species(trace: xr.Dataset) -> None:
    is_missing = trace["sensor"].isnull()
    assert (is_missing.any(("step", "agent")) == is_missing.any("agent").all("step")).all()
    names_of_predators = trace.side[~is_missing.isel(agent=PREDATORS).all(("step", "agent"))]
    names_of_prey = trace.side[~is_missing.isel(agent=PREY).all(("step", "agent"))]
    predators, prey = make_predation().species_experiments()
    assert tuple(names_of_predators.values) == predators.inputs
    assert sorted(names_of_prey.values) == sorted(prey.inputs)
    assert not trace["output"].isnull().any()


def test_an_agent_is_eaten_at_its_last_position(trace: xr.Dataset, predation: Experiment) -> None:
    """The prey that disappears after a step is as near a predator as both could move."""
    n_deaths = -trace["alive"].astype(int).sum("agent").diff("step")
    np.testing.assert_array_equal(n_deaths, trace["prey_eaten"].sum("agent")[:-1])
    assert (trace["x"].isnull() == (trace["alive"] == 0)).all()
    sides = np.array([predation.world.width, predation.world.height])
    positions = np.stack([trace["x"].values, trace["y"].values], axis=-1)
    max_distance = predation.contact.reach + 4
    steps, dead_agents = np.nonzero(np.diff(trace["alive"].values.astype(int), axis=0) < 0)
    for step, agent in zip(steps, dead_agents, strict=True):
        eaters = np.flatnonzero(trace["prey_eaten"].values[step])
        differences = np.abs(positions[step, eaters] - positions[step, agent])
        distances = np.hypot(*np.minimum(differences, sides - differences).T)
        assert distances.min() < max_distance


def test_learning_of_one_species_changes_the_weights_of_this_species(trace: xr.Dataset) -> None:
    changes = (trace["weight_birth"] != trace["weight_death"]).any(("module", "weight"))
    assert not changes.isel(agent=PREDATORS).any()
    assert changes.isel(agent=PREY).any()


def test_a_trace_of_species_is_read_from_netcdf_unchanged(
    trace: xr.Dataset, tmp_path: Path
) -> None:
    trace.to_netcdf(tmp_path / "trace.nc")
    with xr.open_dataset(tmp_path / "trace.nc") as stored:
        xr.testing.assert_identical(stored.load(), trace)


def test_genomes_of_species_with_constant_sizes_are_replayed(
    predation: Experiment, run: xr.Dataset, trace: xr.Dataset
) -> None:
    repeated = replay_genomes(
        predation, run["genome"].values, seed=SEED, run=1, generation=GENERATION
    )
    xr.testing.assert_identical(repeated, trace)


def make_competition(**changes: Any) -> Experiment:
    """Return an experiment whose species have equal settings and compete."""
    prey = {"name": "prey", "size": N_PREY, "eats": {"items": ["food"]}}
    eaters = {"name": "eaters", "size": N_PREDATORS}
    return make_predation(
        population={"size": N_PREDATORS + N_PREY, "species": [eaters, prey]},
        evolution={"generations": 6, "compete": "across"},
        **changes,
    )


@pytest.mark.nightly
def test_a_stored_study_of_competing_species_is_replayed(tmp_path: Path) -> None:
    """Sizes change, and genomes of some generations are not stored."""
    experiment = make_competition(record={"genome_every": 4})
    study = bl.run(experiment, runs=1, seed=SEED, out=tmp_path / "study")
    data = study.data().isel(condition=0, run=0)
    n_eaters = (data["species"] == 0).sum("agent").values
    assert len({*n_eaters.tolist()}) > 1
    for generation in (0, 3, 4):
        trace = study.replay(run=0, generation=generation)
        np.testing.assert_array_equal(trace["species"], data["species"][generation])
        np.testing.assert_array_equal(trace["eaten"].sum("step"), data["food_eaten"][generation])
        xr.testing.assert_identical(trace, bl.replay(experiment, seed=SEED, generation=generation))


def test_genomes_of_competing_species_are_refused_without_their_species() -> None:
    experiment = make_competition()
    shape = (N_PREDATORS + N_PREY, len(experiment.modules), experiment.genome_length)
    with pytest.raises(RefusedError, match="the sizes of the species change; replay a stored"):
        replay_genomes(experiment, np.zeros(shape, np.float32))
