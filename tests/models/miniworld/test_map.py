"""Test movement, contact and eating at positions that are exact in float32."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from scipy.stats import chisquare, kstest

from baldwinlab.simulation.replay import replay
from tests.worlds import (
    make_single_agent_experiment,
    make_small_experiment,
    replay_with_first_action,
)

FORWARD = 1


@pytest.mark.parametrize("reach", [10, 5, 2])
def test_an_item_is_touched_at_distances_below_the_reach(reach: float) -> None:
    # The contact is at the position after the move, which is 2 ahead of the birthplace.
    for x, eaten in (
        (102 + reach, 0),
        (102 + reach - 2**-14, 1),
        (102 - reach, 0),
        (102 - reach + 2**-14, 1),
    ):
        trace = replay_with_first_action(
            FORWARD,
            make_single_agent_experiment((100, 80), [(x, 80)], contact={"reach": reach}),
        )
        assert trace["eaten"].values[0, 0] == eaten


@pytest.mark.parametrize(("shape", "eaten"), [("circle", 0), ("square", 1)])
def test_corners_of_squares_touch_at_distances_at_which_circles_do_not(
    shape: str, eaten: int
) -> None:
    # The distance is 9.5 along each axis, and 13.4 in total.
    for x, y in ((111.5, 89.5), (92.5, 89.5), (111.5, 70.5), (92.5, 70.5)):
        trace = replay_with_first_action(
            FORWARD, make_single_agent_experiment((100, 80), [(x, y)], contact={"shape": shape})
        )
        assert trace["eaten"].values[0, 0] == eaten
    for x, y in ((112, 80), (102, 90)):
        trace = replay_with_first_action(
            FORWARD, make_single_agent_experiment((100, 80), [(x, y)], contact={"shape": shape})
        )
        assert trace["eaten"].values[0, 0] == 0


def sample_positions(seed_count: int) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
    """Return positions [2, n] of agents at birth, and of items at the start and later."""
    food = [{"x": [120, 180], "y": [20, 50], "count": 40}]
    experiment = make_single_agent_experiment(
        (20, 60),
        [],
        world={"food": food, "start": {"x": 150, "y": 35, "radius": 30}},
        population={"size": 40},
    )
    traces = [
        replay(experiment.replace(lifetime={"steps": 12}), seed=seed) for seed in range(seed_count)
    ]
    births = np.hstack([np.array([trace["x"].values[0], trace["y"].values[0]]) for trace in traces])
    items = []
    for trace in traces:
        x = trace["item_x"].values
        y = trace["item_y"].values
        is_new = np.vstack([np.ones((1, x.shape[1]), bool), x[1:] != x[:-1]])
        items.append(np.array([x[is_new], y[is_new]]))
    return births, np.hstack(items)


def test_birthplaces_are_uniform_in_the_start_disc_and_headings_are_0() -> None:
    (x, y), _ = sample_positions(20)
    distance = np.hypot(x - 150, y - 35)
    angle = np.arctan2(y - 35, x - 150)
    assert distance.max() <= 30
    assert kstest((distance / 30) ** 2, "uniform").pvalue > 0.001
    assert kstest(angle / (2 * np.pi) + 0.5, "uniform").pvalue > 0.001
    trace = replay(make_single_agent_experiment((100, 80), [], population={"size": 50}))
    assert (trace["heading"] == 0).all()


def test_items_appear_and_reappear_uniformly_in_their_region() -> None:
    _, (x, y) = sample_positions(20)
    assert x.size > 1000
    assert kstest((x - 120) / 60, "uniform").pvalue > 0.001
    assert kstest((y - 20) / 30, "uniform").pvalue > 0.001
    assert abs(np.corrcoef(x, y)[0, 1]) < 0.1


def test_motor_noise_replaces_actions_with_the_given_probability() -> None:
    for noise in (0.0, 0.3, 1.0):
        trace = replay(
            make_small_experiment(
                "evo", motor={"noise": noise}, population={"size": 20}, lifetime={"steps": 500}
            ),
            seed=5,
        )
        actions = trace["action"].values.astype(int)
        replaced = actions != trace["output"].values.argmax(axis=-1)
        # A third of the random actions are equal to the chosen action.
        expected = noise * 2 / 3
        error = np.sqrt(expected * (1 - expected) / replaced.size)
        assert abs(replaced.mean() - expected) <= 4 * error
        turns = np.diff(trace["heading"].values, axis=0) % 360
        np.testing.assert_array_equal(turns, ((actions[:-1] - 1) * 9) % 360)
    assert chisquare(np.bincount(actions.ravel(), minlength=3)).pvalue > 0.001


def test_random_headings_are_uniform_over_forty_values() -> None:
    experiment = make_small_experiment(
        "evo",
        world={"start": {"headings": "random"}},
        population={"size": 4000},
        lifetime={"steps": 1},
    )
    headings = replay(experiment, seed=5)["heading"].values[0]
    assert set(headings % 9) == {0}
    assert chisquare(np.bincount((headings / 9).astype(int), minlength=40)).pvalue > 0.001
