"""Moving, touching and eating, at places that float32 holds exactly."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import pytest
from scipy.stats import chisquare, kstest

from baldwinlab.simulation.replay import replay
from baldwinlab.simulation.simulate import simulate
from tests.worlds import (
    make_point_region,
    make_single_agent_experiment,
    make_small_experiment,
    replay_with_first_action,
)

LEFT, FORWARD, RIGHT = 0, 1, 2


@pytest.mark.parametrize(
    ("action", "turn", "speed"), [(LEFT, -9, 1), (FORWARD, 0, 2), (RIGHT, 9, 1)]
)
def test_a_turn_is_9_degrees_and_comes_before_the_move(action: int, turn: int, speed: int) -> None:
    trace = replay_with_first_action(
        action, make_single_agent_experiment((100, 80), [], lifetime={"steps": 2})
    )
    angle = math.radians(turn)
    assert trace["heading"].values[1, 0] == turn % 360
    assert trace["x"].values[1, 0] == pytest.approx(100 + speed * math.cos(angle), abs=1e-5)
    assert trace["y"].values[1, 0] == pytest.approx(80 + speed * math.sin(angle), abs=1e-5)


@pytest.mark.parametrize(("x", "after"), [(198, 0), (199, 1), (197.5, 199.5)])
def test_positions_wrap_at_the_edge_of_the_map(x: float, after: float) -> None:
    trace = replay_with_first_action(
        FORWARD, make_single_agent_experiment((x, 80), [], lifetime={"steps": 2})
    )
    assert trace["x"].values[1, 0] == after


@pytest.mark.parametrize("reach", [10, 5, 2])
def test_an_item_is_touched_nearer_than_the_reach_and_not_at_it(reach: float) -> None:
    # It is touched from where the agent goes, which is 2 ahead of where it was born.
    for place, eaten in (
        (102 + reach, 0),
        (102 + reach - 2**-14, 1),
        (102 - reach, 0),
        (102 - reach + 2**-14, 1),
    ):
        trace = replay_with_first_action(
            FORWARD,
            make_single_agent_experiment((100, 80), [(place, 80)], contact={"reach": reach}),
        )
        assert trace["eaten"].values[0, 0] == eaten


@pytest.mark.parametrize(("shape", "eaten"), [("circle", 0), ("square", 1)])
def test_the_corners_of_squares_touch_where_circles_do_not(shape: str, eaten: int) -> None:
    for x, y in (
        (111.5, 89.5),
        (92.5, 89.5),
        (111.5, 70.5),
        (92.5, 70.5),
    ):  # 9.5 away along either axis, 13.4 in all
        trace = replay_with_first_action(
            FORWARD, make_single_agent_experiment((100, 80), [(x, y)], contact={"shape": shape})
        )
        assert trace["eaten"].values[0, 0] == eaten
    for x, y in ((112, 80), (102, 90)):
        trace = replay_with_first_action(
            FORWARD, make_single_agent_experiment((100, 80), [(x, y)], contact={"shape": shape})
        )
        assert trace["eaten"].values[0, 0] == 0


def test_bodies_touch_over_the_edges_of_the_map() -> None:
    trace = replay_with_first_action(FORWARD, make_single_agent_experiment((195, 1), [(3, 158)]))
    assert trace["eaten"].values[0, 0] == 1


@pytest.mark.parametrize("update", ["simultaneous", "sequential"])
def test_an_item_is_eaten_by_the_first_agent_in_the_order_of_the_step(update: str) -> None:
    lives = {"steps": 9, "update": update}
    # All agents touch both items all the time, and what is eaten reappears where it was.
    crowd = make_single_agent_experiment(
        (100, 80),
        [(100, 80), (101, 81)],
        population={"size": 4},
        contact={"reach": 60},
        lifetime=lives,
    )
    eaten = replay(crowd)["eaten"].values
    assert eaten.tolist() == [
        [2 if agent == step % 4 else 0 for agent in range(4)] for step in range(9)
    ]


def test_an_item_gives_the_energy_of_its_region() -> None:
    world = {
        "food": [
            make_point_region(100, 80, count=2, energy=2.5),
            make_point_region(20, 20, energy=100),
            make_point_region(101, 80, count=3, energy=0),
        ]
    }
    crowd = make_single_agent_experiment(
        (100, 80), [], world=world, population={"size": 3}, lifetime={"steps": 2}
    )
    result = simulate(crowd)
    assert result["food_eaten"].values.tolist() == [[5, 5, 0]]
    assert result["energy"].values.tolist() == [[5, 5, 0]]


def places(seed_count: int) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
    """Where agents were born and where items lay and reappeared, each [2, n]."""
    food = [{"x": [120, 180], "y": [20, 50], "count": 40}]
    crowd = make_single_agent_experiment(
        (20, 60),
        [],
        world={"food": food, "start": {"x": 150, "y": 35, "radius": 30}},
        population={"size": 40},
    )
    traces = [
        replay(crowd.replace(lifetime={"steps": 12}), seed=seed) for seed in range(seed_count)
    ]
    births = np.hstack([np.array([trace["x"].values[0], trace["y"].values[0]]) for trace in traces])
    items = []
    for trace in traces:
        x, y = trace["item_x"].values, trace["item_y"].values
        came = np.vstack([np.ones((1, x.shape[1]), bool), x[1:] != x[:-1]])
        items.append(np.array([x[came], y[came]]))
    return births, np.hstack(items)


def test_agents_are_born_uniformly_in_the_disc_and_look_along_x() -> None:
    (x, y), _ = places(20)
    distance, angle = np.hypot(x - 150, y - 35), np.arctan2(y - 35, x - 150)
    assert distance.max() <= 30
    assert kstest((distance / 30) ** 2, "uniform").pvalue > 0.001
    assert kstest(angle / (2 * np.pi) + 0.5, "uniform").pvalue > 0.001
    assert (
        replay(make_single_agent_experiment((100, 80), [], population={"size": 50}))["heading"] == 0
    ).all()


def test_items_lie_and_reappear_uniformly_in_their_region() -> None:
    _, (x, y) = places(20)
    assert x.size > 1000
    assert kstest((x - 120) / 60, "uniform").pvalue > 0.001
    assert kstest((y - 20) / 30, "uniform").pvalue > 0.001
    assert abs(np.corrcoef(x, y)[0, 1]) < 0.1


def test_without_motor_noise_the_chosen_action_is_done_and_with_it_now_and_then_another() -> None:
    for noise in (0.0, 0.3, 1.0):
        trace = replay(
            make_small_experiment(
                "evo", motor={"noise": noise}, population={"size": 20}, lifetime={"steps": 500}
            ),
            seed=5,
        )
        done = trace["action"].values.astype(int)
        other = done != trace["output"].values.argmax(axis=-1)
        expected = noise * 2 / 3  # one of three draws is the chosen action
        assert abs(other.mean() - expected) <= 4 * np.sqrt(expected * (1 - expected) / other.size)
        turned = np.diff(trace["heading"].values, axis=0) % 360
        np.testing.assert_array_equal(turned, ((done[:-1] - 1) * 9) % 360)
    assert chisquare(np.bincount(done.ravel(), minlength=3)).pvalue > 0.001


def test_random_headings_are_uniform_over_the_forty_there_are() -> None:
    experiment = make_small_experiment(
        "evo",
        world={"start": {"headings": "random"}},
        population={"size": 4000},
        lifetime={"steps": 1},
    )
    headings = replay(experiment, seed=5)["heading"].values[0]
    assert set(headings % 9) == {0}
    assert chisquare(np.bincount((headings / 9).astype(int), minlength=40)).pvalue > 0.001
