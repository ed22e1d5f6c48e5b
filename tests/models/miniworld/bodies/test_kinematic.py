"""Bodies of the library: where each action leads, and what each refuses."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import xarray as xr

from baldwinlab.experiment import Experiment, ExperimentError
from baldwinlab.models.miniworld.appearance import describe_appearance
from tests.models.miniworld.plain import traced
from tests.worlds import make_small_experiment

pytestmark = pytest.mark.usefixtures("in_plain_python")


def who_is(body: str, noise: float = 0.5, **fields: Any) -> Experiment:
    short = {
        "lifetime": {"steps": 80},
        "population": {"size": 4},
        "world": {"start": {"headings": "random"}},
    }
    table = {body: fields} if fields else {}
    return make_small_experiment("evo", motor={"body": body, "noise": noise, **table}, **short)


def moves(trace: xr.Dataset) -> tuple[npt.NDArray[Any], npt.NDArray[Any], npt.NDArray[Any]]:
    """What was done, the way that it led, and the turn in degrees, [step, agent] each, of all steps but the last."""
    turn = (np.diff(trace.heading.values, axis=0) + 180) % 360 - 180
    return trace.action.values[:-1], np.hypot(*ways(trace)), turn


def ways(trace: xr.Dataset) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
    """To the right and downwards, over the edges of the map."""
    along = (np.diff(trace.x.values.astype(float), axis=0) + 60) % 120 - 60
    down = (np.diff(trace.y.values.astype(float), axis=0) + 50) % 100 - 50
    return along, down


def test_who_can_stay_has_the_papers_three_actions_and_stands_still_by_the_fourth() -> None:
    experiment = who_is("stay")
    did, way, turn = moves(traced(experiment))
    assert experiment.layer_sizes[-1] == 4
    for action, (length, degrees) in enumerate([(1, -9), (2, 0), (1, 9), (0, 0)]):
        assert (did == action).any()
        np.testing.assert_allclose(way[did == action], length, atol=1e-4)
        np.testing.assert_allclose(turn[did == action], degrees, atol=1e-4)


def test_who_stays_is_touched_by_no_wall_but_feels_that_it_has_not_moved() -> None:
    trace = traced(who_is("stay").replace(senses={"kinds": ["food", "touch"]}))
    np.testing.assert_array_equal(
        trace.sensor.sel(side="stopped").values[1:], trace.action.values[:-1] == 3
    )


def test_on_a_grid_one_goes_by_2_where_one_heads_then() -> None:
    trace = traced(who_is("grid"))
    did, (along, down) = trace.action.values[:-1], ways(trace)
    for action, (right, below) in enumerate([(2, 0), (0, 2), (-2, 0), (0, -2)]):
        assert (did == action).any()
        np.testing.assert_allclose(along[did == action], right, atol=1e-4)
        np.testing.assert_allclose(down[did == action], below, atol=1e-4)
        assert set(trace.heading.values[1:][did == action]) == {90 * action}


@pytest.mark.parametrize("degrees", [36.0, 180.0])
def test_wheels_go_by_the_sum_of_the_outputs_and_turn_by_their_difference(degrees: float) -> None:
    trace = traced(who_is("continuous", noise=0, max_turn=degrees), 5)
    outputs = trace.output.values[:-1].astype(float)
    did, way, turn = moves(trace)
    np.testing.assert_allclose(way, outputs.sum(axis=-1), atol=1e-4)
    wanted = 9 * np.rint((outputs[..., 0] - outputs[..., 1]) * degrees / 9)
    np.testing.assert_allclose((turn - wanted + 180) % 360, 180, atol=1e-3)
    assert len(np.unique(turn)) > 2
    np.testing.assert_array_equal(did, outputs[..., 1] > outputs[..., 0])


def test_wheels_whose_turn_is_0_go_straight_on() -> None:
    assert not moves(traced(who_is("continuous", noise=0, max_turn=0)))[2].any()


def test_wheels_refuse_noise_that_would_draw_another_action() -> None:
    with pytest.raises(ExperimentError, match=r"motor\.noise must be 0 with motor\.body"):
        who_is("continuous", noise=0.1)


def test_actions_are_named_in_the_look() -> None:
    assert describe_appearance(who_is("stay")).actions == ("left", "forward", "right", "stay")
    assert describe_appearance(who_is("grid")).actions == ("right", "down", "left", "up")
    assert describe_appearance(who_is("continuous", noise=0)).actions == (
        "left wheel",
        "right wheel",
    )
