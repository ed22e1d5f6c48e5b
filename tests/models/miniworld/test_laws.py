"""Test laws of the model for all weights, and results of evolution that are known in advance."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

import baldwinlab as bl
from baldwinlab.papers.presets import load
from baldwinlab.simulation.replay import replay
from baldwinlab.simulation.simulate import simulate
from tests.worlds import make_small_experiment

CONDITIONS = ("evo", "evo+self-taught", "self-taught")


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_on_map_b_agents_without_learning_never_eat(seed: int) -> None:
    result = simulate(load("evo/B").replace(evolution={"generations": 4}), seed=seed)
    assert (result["food_eaten"] == 0).all()
    assert (result["energy"] == 0).all()


def test_on_map_b_agents_that_learn_can_eat() -> None:
    result = simulate(load("evo+self-taught/B").replace(evolution={"generations": 4}), seed=0)
    assert result["food_eaten"].sum() > 0


@pytest.mark.parametrize("condition", CONDITIONS)
def test_without_food_no_agent_eats_and_evolution_continues(condition: str) -> None:
    empty = [{"x": [20, 100], "y": [10, 90], "count": 0}]
    for food in ([], empty, empty * 3):
        result = simulate(make_small_experiment(condition, world={"food": food}))
        assert (result["food_eaten"] == 0).all()
        assert (result["energy"] == 0).all()
        assert np.isfinite(result["genome"]).all()
        trace = replay(make_small_experiment(condition, world={"food": food}), generation=2)
        assert trace.sizes["item"] == 0
        assert (trace["sensor"] == 0).all()


def test_a_region_without_items_has_no_effect_on_other_regions() -> None:
    full = {"x": [20, 100], "y": [10, 90], "count": 12}
    empty = full | {"count": 0}
    expected, actual = (
        simulate(make_small_experiment("evo+self-taught", world={"food": food}), seed=4)
        for food in ([full], [full, empty])
    )
    assert expected["food_eaten"].sum() > 0
    np.testing.assert_array_equal(actual["food_eaten"], expected["food_eaten"])
    np.testing.assert_array_equal(actual["genome"], expected["genome"])


@pytest.mark.parametrize("map_name", ["A", "B"])
def test_the_conditions_of_a_map_share_newborns_food_and_action_modules(map_name: str) -> None:
    traces = [
        replay(load(f"{condition}/{map_name}").replace(lifetime={"steps": 1}), seed=6)
        for condition in CONDITIONS
    ]
    for trace in traces[1:]:
        for name in ("x", "y", "heading", "item_x", "item_y"):
            np.testing.assert_array_equal(trace[name], traces[0][name], err_msg=name)
        np.testing.assert_array_equal(trace["weight_birth"][:, 0], traces[0]["weight_birth"][:, 0])


def test_each_seed_run_and_generation_has_different_birthplaces() -> None:
    experiment = make_small_experiment("self-taught", lifetime={"steps": 1})
    keys = list(product((0, 1), (0, 1), (0, 1, 2)))
    traces = [
        replay(experiment, seed=seed, run=run, generation=generation)
        for seed, run, generation in keys
    ]
    for name in ("x", "item_x", "weight_birth"):
        first_values = [trace[name].values.ravel()[0] for trace in traces]
        assert np.unique(first_values).size == len(keys), name


@settings(max_examples=40)
@given(
    st.sampled_from(CONDITIONS),
    st.integers(0, 2**31 - 1),
    st.integers(0, 1000),
    st.integers(0, 2),
    st.sampled_from(["simultaneous", "sequential"]),
    st.booleans(),
)
def test_a_replay_agrees_with_the_simulated_run(
    condition: str, seed: int, number: int, generation: int, update: str, biases: bool
) -> None:
    experiment = make_small_experiment(
        condition, lifetime={"update": update}, network={"biases": biases}
    )
    run = simulate(experiment, seed=seed, run=number)
    trace = replay(experiment, seed=seed, run=number, generation=generation)
    np.testing.assert_array_equal(trace["eaten"].sum("step"), run["food_eaten"][generation])
    np.testing.assert_array_equal(trace["weight_birth"], run["genome"][generation])


def share_of_poison(study: bl.Study, condition: str, generations: slice) -> npt.NDArray[np.float64]:
    """Return the share of poison among the eaten items, by run."""
    eaten = (
        study.data()[["patch_eaten", "food_eaten"]]
        .sel(condition=condition)
        .isel(generation=generations)
    )
    run = eaten.sum(("generation", "agent"))
    return np.asarray(run.patch_eaten / (run.patch_eaten + run.food_eaten))


@pytest.mark.nightly
def test_agents_that_sense_poison_evolve_to_avoid_it(tmp_path: Path) -> None:
    """Agents that do not sense poison avoid it a little, because they move to visible food.

    An item of poison costs twice the energy of an item of food.
    """
    world = {"patches": {"patches": [[400, 560, 80, 240, 25, -2]]}}
    size = {
        "population": {"size": 100},
        "evolution": {"generations": 150},
        "record": {"genome_every": 150},
    }
    sensed = bl.load("evo/D").replace(name="sensed", world=world, **size)
    unsensed = sensed.replace(name="unsensed", senses={"kinds": ["food"]})
    study = bl.run([sensed, unsensed], runs=4, out=tmp_path / "poison")
    first = {name: share_of_poison(study, name, slice(0, 10)) for name in study.conditions}
    last = {name: share_of_poison(study, name, slice(-10, None)) for name in study.conditions}
    assert (first["sensed"] - last["sensed"]).min() > 0.08
    assert (first["unsensed"] - last["unsensed"]).max() < 0.08
    assert last["sensed"].max() < last["unsensed"].min()


def simulate_scripted_foragers(experiment: bl.Experiment, worlds: int) -> npt.NDArray[np.float64]:
    """Return the mean number of items that scripted foragers eat, by world.

    They go to visible food in front, else to the left, else to the right, and else forward.
    """
    environment = bl.vector_env(experiment, worlds=worlds)
    sensed, _ = environment.reset(seed=0)
    eaten = np.zeros(environment.num_envs)
    for _ in range(experiment.lifetime.steps):
        left, front, right = sensed.T > 0
        sensed, reward, *_ = environment.step(np.select([front, left, right], [1, 0, 2], 1))
        eaten += reward
    return np.asarray(eaten.reshape(worlds, -1).mean(axis=1))


@pytest.mark.nightly
def test_agents_with_learning_eat_more_than_scripted_foragers(tmp_path: Path) -> None:
    """Learned weights are a memory. Without learning, agents eat at most as much.

    On map A, an agent that goes forward reaches the food.
    """
    study = bl.run(["evo/A", "evo+self-taught/A"], runs=10, out=tmp_path / "memory")
    scripted = simulate_scripted_foragers(bl.load("evo/A"), 20)
    average = study.data().energy.isel(generation=slice(-10, None)).mean(("generation", "agent"))
    comparisons = {
        name: stats.mannwhitneyu(average.sel(condition=name), scripted, alternative="greater")
        for name in study.conditions
    }
    assert comparisons["evo/A"].pvalue > 0.5
    assert comparisons["evo+self-taught/A"].pvalue < 0.001
