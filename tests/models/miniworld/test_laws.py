"""What must be so, whatever the weights: laws of the model that follow from the paper."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
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


def test_far_from_food_an_agent_without_learning_repeats_its_first_action() -> None:
    trace = replay(load("evo/B").replace(lifetime={"steps": 300}), seed=3)
    assert (trace["sensor"] == 0).all()
    actions = trace["action"].values
    assert set(actions[0].tolist()) == {0, 1, 2}
    assert (actions == actions[0]).all()


def test_an_agent_that_always_turns_runs_in_a_circle_of_radius_6_4() -> None:
    trace = replay(load("evo/B").replace(lifetime={"steps": 41}), seed=3)
    x, y, actions = trace["x"].values, trace["y"].values, trace["action"].values[0]
    for agent in np.flatnonzero(actions != 1):
        assert abs(x[40, agent] - x[0, agent]) < 1e-3
        assert abs(y[40, agent] - y[0, agent]) < 1e-3
        centre = x[:40, agent].mean(), y[:40, agent].mean()
        radii = np.hypot(x[:, agent] - centre[0], y[:, agent] - centre[1])
        np.testing.assert_allclose(radii, 0.5 / np.sin(np.radians(4.5)), atol=1e-3)  # 6.373
        assert np.sign(centre[1] - y[0, agent]) == (
            1 if actions[agent] == 2 else -1
        )  # right is down


def test_an_agent_that_always_goes_forward_runs_along_a_horizontal_line() -> None:
    trace = replay(load("evo/B").replace(lifetime={"steps": 700}), seed=3)
    forward = trace.isel(agent=np.flatnonzero(trace["action"].values[0] == 1))
    assert (forward["y"] == forward["y"][0]).all()
    moved = np.diff(forward["x"].values, axis=0) % 640
    np.testing.assert_allclose(moved, 2, atol=1e-3)


@pytest.mark.parametrize("condition", CONDITIONS)
def test_without_food_nobody_eats_and_evolution_goes_on(condition: str) -> None:
    empty = [{"x": [20, 100], "y": [10, 90], "count": 0}]
    for food in ([], empty, empty * 3):
        result = simulate(make_small_experiment(condition, world={"food": food}))
        assert (result["food_eaten"] == 0).all()
        assert (result["energy"] == 0).all()
        assert np.isfinite(result["genome"]).all()
        trace = replay(make_small_experiment(condition, world={"food": food}), generation=2)
        assert trace.sizes["item"] == 0
        assert (trace["sensor"] == 0).all()


def test_a_region_without_items_changes_nothing_for_the_others() -> None:
    full = {"x": [20, 100], "y": [10, 90], "count": 12}
    alone = simulate(make_small_experiment("evo+self-taught", world={"food": [full]}), seed=4)
    beside = simulate(
        make_small_experiment("evo+self-taught", world={"food": [full, full | {"count": 0}]}),
        seed=4,
    )
    assert alone["food_eaten"].sum() > 0
    np.testing.assert_array_equal(alone["food_eaten"], beside["food_eaten"])
    np.testing.assert_array_equal(alone["genome"], beside["genome"])


@pytest.mark.parametrize("condition", CONDITIONS)
def test_one_agent_lives_and_breeds_alone(condition: str) -> None:
    result = simulate(
        make_small_experiment(condition, population={"size": 1}, lifetime={"steps": 300}), seed=1
    )
    assert result["food_eaten"].shape == (3, 1)
    assert result["food_eaten"].sum() > 0
    expected = -1 if condition == "self-taught" else 0
    assert (result["parents"][1:] == expected).all()


def test_learning_at_the_rate_0_gives_the_life_of_agents_that_do_not_learn() -> None:
    still = replay(
        make_small_experiment("evo+self-taught", learning={"rate": 0}, lifetime={"steps": 400}),
        seed=5,
    )
    evo = replay(make_small_experiment("evo", lifetime={"steps": 400}), seed=5)
    assert evo["eaten"].sum() > 10
    for name in ("x", "y", "heading", "item_x", "item_y", "sensor", "output", "action", "eaten"):
        np.testing.assert_array_equal(still[name].values, evo[name].values, err_msg=name)
    np.testing.assert_array_equal(still["weight_death"], still["weight_birth"])


def test_learning_brings_the_action_module_nearer_to_the_reinforcement_module() -> None:
    trace = replay(load("evo+self-taught/B"), seed=2)
    nothing = (trace["sensor"] == 0).all("side").all("step").values
    assert nothing.any()
    middle = 0.5 * np.ones(
        (trace.sizes["agent"], 10), np.float32
    )  # the hidden units when no food is seen

    def outputs(weights: npt.NDArray[np.float32]) -> npt.NDArray[np.float64]:
        result: npt.NDArray[np.float64] = 1 / (
            1 + np.exp(-np.einsum("ah,aho->ao", middle, weights[:, 30:].reshape(-1, 10, 3)))
        )
        return result

    target = outputs(trace["weight_birth"].values[:, 1])
    distance = [
        np.abs(outputs(trace[name].values[:, 0]) - target)[nothing].max(axis=1)
        for name in ("weight_birth", "weight_death")
    ]
    assert (distance[1] < distance[0]).all()
    assert np.median(distance[1]) < 0.1 * np.median(distance[0])


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


def test_seeds_runs_and_generations_have_birthplaces_of_their_own() -> None:
    brief = make_small_experiment("self-taught", lifetime={"steps": 1})
    moments = [
        (seed, run, generation) for seed in (0, 1) for run in (0, 1) for generation in (0, 1, 2)
    ]
    traces = [
        replay(brief, seed=seed, run=run, generation=generation)
        for seed, run, generation in moments
    ]
    for name in ("x", "item_x", "weight_birth"):
        assert np.unique([trace[name].values.ravel()[0] for trace in traces]).size == len(
            moments
        ), name


@settings(deadline=None, derandomize=True, max_examples=40, database=None)
@given(
    st.sampled_from(CONDITIONS),
    st.integers(0, 2**31 - 1),
    st.integers(0, 2),
    st.sampled_from(["simultaneous", "sequential"]),
    st.booleans(),
)
def test_a_replayed_life_is_the_life_that_was_lived(
    condition: str, seed: int, generation: int, update: str, biases: bool
) -> None:
    experiment = make_small_experiment(
        condition, lifetime={"update": update}, network={"biases": biases}
    )
    lived, trace = (
        simulate(experiment, seed=seed),
        replay(experiment, seed=seed, generation=generation),
    )
    np.testing.assert_array_equal(trace["eaten"].sum("step"), lived["food_eaten"][generation])
    np.testing.assert_array_equal(trace["weight_birth"], lived["genome"][generation])
