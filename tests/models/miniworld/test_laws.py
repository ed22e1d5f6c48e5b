"""Test laws of the model that follow from the paper for all weights."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

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
