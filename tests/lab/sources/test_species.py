"""Tests of several species in the lab: their description, their recordings and their curves."""

from __future__ import annotations

import numpy as np
import pytest

from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import Experiment
from baldwinlab.lab.sources import binary_frames, life_query, recording
from baldwinlab.lab.sources.inspector import inspect_agent
from baldwinlab.lab.sources.life_query import Life, Span, StartData
from baldwinlab.lab.sources.live_run import LiveRun
from baldwinlab.lab.sources.model_displays import describe_species
from baldwinlab.papers.presets import load
from baldwinlab.simulation.replay import replay
from baldwinlab.simulation.simulate import simulate
from tests.worlds import PREY_ENERGY, make_predation

STEPS = 150


def load_predators() -> Experiment:
    return load("no-learning").replace(evolution={"generations": 2}, lifetime={"steps": STEPS})


def load_hunt() -> Experiment:
    """Return the predators and prey that tests of the page of a study compile, too."""
    return make_predation(evolution={"generations": 2}).replace(name="hunt")


def find_life(experiment: Experiment, generation: int) -> Life:
    """Return a lifetime of run 0, from a simulation of the run."""
    key = GenerationKey(seed=0, run=0, generation=generation)
    return Life(experiment, key, lambda: life_query.simulate_species(experiment, key))


def test_species_have_different_shapes_and_colors_and_their_own_inputs() -> None:
    predators, prey = describe_species(load_predators())["species"]
    assert (predators["name"], prey["name"]) == ("predators", "prey")
    assert predators["shape"] != prey["shape"]
    assert predators["color"] != prey["color"]
    # Both species see agents of other species, and only prey sees food.
    assert len(predators["inputs"]) == 3
    assert {*predators["inputs"]} < {*prey["inputs"]}
    assert describe_species(load("evo/A")) == {}


@pytest.mark.nightly
def test_a_recording_of_species_is_their_replay() -> None:
    experiment = load_predators()
    trace = replay(experiment, seed=0, run=0, generation=1)
    life = find_life(experiment, generation=1)
    header, arrays = binary_frames.unpack(recording.record_life(life, Span(0, STEPS), {}))
    assert [species["name"] for species in header["species"]] == ["predators", "prey"]
    assert np.array_equal(arrays["species"], trace.species)
    for name in ("x", "y"):
        assert np.array_equal(arrays[name], trace[name], equal_nan=True)
    assert np.isnan(arrays["x"]).any()
    assert np.array_equal(arrays["action"], trace.action)
    assert np.array_equal(arrays["eaten_in_life"], trace.eaten.cumsum("step"))
    inputs = np.unpackbits(
        arrays["sensor"].reshape(STEPS, 30, 1), axis=2, bitorder="little", count=6
    )
    assert np.array_equal(inputs, trace.sensor.fillna(0))


def test_the_inspector_names_the_species_and_counts_the_eaten_agents() -> None:
    experiment = load_hunt()
    run = simulate(experiment, seed=0)
    life = find_life(experiment, generation=1)
    lifetime = Span(0, experiment.lifetime.steps)
    for agent, name, energy in ((2, "predators", PREY_ENERGY), (14, "prey", 1)):
        header, _ = binary_frames.unpack(inspect_agent(life, lifetime, agent))
        fitness = run.energy.values[1]
        rivals = fitness[run.species.values[1] == run.species.values[1, agent]]
        assert header["species"] == name
        assert header["rank"] == 1 + (rivals > fitness[agent]).sum()
        assert header["food"] * energy == fitness[agent]
        assert header["parents"] == run.parents.values[1, agent].tolist()


def test_a_live_run_of_species_is_a_simulation_with_a_curve_for_each_species() -> None:
    experiment = load_hunt()
    live_run = LiveRun(experiment, seed=0, n_runs=1)
    live_run.wait()
    assert live_run.state == "done", live_run.message
    expected = simulate(experiment, seed=0)
    measures = live_run.compute_measures(0, 2)
    for number, name in enumerate(("predators", "prey")):
        members = expected.where(expected.species == number)
        assert measures[f"mean:{name}"]["mean"] == members.energy.mean("agent").values.tolist()
        assert measures[f"survivors:{name}"]["mean"] == members.alive.sum("agent").values.tolist()
    for generation in (0, 1):
        genomes = live_run.read_genomes(0, generation)
        start = find_life(experiment, generation).load_start_data()
        assert isinstance(start, StartData)
        assert np.array_equal(genomes, start.genomes)
