"""Test the movement of the bodies of the library, and the settings that they refuse."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from baldwinlab.experiment import Experiment, ExperimentError
from baldwinlab.models.miniworld.appearance import describe_appearance
from tests.models.miniworld.plain import replay_in_python
from tests.worlds import make_small_experiment

pytestmark = pytest.mark.usefixtures("in_plain_python")


def make_experiment_with_body(body: str, noise: float = 0.5, **fields: Any) -> Experiment:
    short = {
        "lifetime": {"steps": 80},
        "population": {"size": 4},
        "world": {"start": {"headings": "random"}},
    }
    table = {body: fields} if fields else {}
    return make_small_experiment("evo", motor={"body": body, "noise": noise, **table}, **short)


def test_touch_reports_an_agent_that_stays_as_stopped() -> None:
    trace = replay_in_python(
        make_experiment_with_body("stay").replace(senses={"kinds": ["food", "touch"]})
    )
    np.testing.assert_array_equal(
        trace.sensor.sel(side="stopped").values[1:], trace.action.values[:-1] == 3
    )


def test_wheels_with_a_maximum_turn_of_0_go_straight() -> None:
    experiment = make_experiment_with_body("continuous", noise=0, max_turn=0)
    assert not np.diff(replay_in_python(experiment).heading.values, axis=0).any()


def test_wheels_refuse_motor_noise() -> None:
    with pytest.raises(ExperimentError, match=r"motor\.noise must be 0 with motor\.body"):
        make_experiment_with_body("continuous", noise=0.1)


def test_the_appearance_has_the_names_of_actions() -> None:
    actions = {
        "stay": ("left", "forward", "right", "stay"),
        "grid": ("right", "down", "left", "up"),
        "continuous": ("left wheel", "right wheel"),
    }
    for body, names in actions.items():
        assert describe_appearance(make_experiment_with_body(body, noise=0)).actions == names
