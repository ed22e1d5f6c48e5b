"""Test the sight of food at positions that are exact in float32.

The heading of newborns is along +x. The y axis points down.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from baldwinlab.simulation.replay import replay
from tests.worlds import make_single_agent_experiment

LEFT = [1, 0, 0]
FRONT = [0, 1, 0]
RIGHT = [0, 0, 1]
NOTHING = [0, 0, 0]


def sense_at_birth(
    agent: tuple[float, float], *items: tuple[float, float], **changes: Any
) -> list[int]:
    trace = replay(make_single_agent_experiment(agent, list(items), **changes))
    inputs: list[int] = trace["sensor"].values[0, 0].tolist()
    return inputs


def sense_item_at(degrees: float, distance: float, **changes: Any) -> list[int]:
    angle = math.radians(degrees)
    return sense_at_birth(
        (100, 80), (100 + distance * math.cos(angle), 80 + distance * math.sin(angle)), **changes
    )


SENSOR_BY_ANGLE = {
    0: FRONT,
    14.99: FRONT,
    15.01: RIGHT,
    44.99: RIGHT,
    315.01: LEFT,
    344.99: LEFT,
    345.01: FRONT,
}
INVISIBLE_ANGLES = (45.01, 90, 135, 165, 180, 195, 225, 270, 314.99)


@pytest.mark.parametrize(
    ("degrees", "expected"),
    [*SENSOR_BY_ANGLE.items(), *((degrees, NOTHING) for degrees in INVISIBLE_ANGLES)],
)
@pytest.mark.parametrize("distance", [0.5, 12, 39.99])
def test_the_sensor_of_an_item_depends_on_its_angle(
    degrees: float, distance: float, expected: list[int]
) -> None:
    assert sense_item_at(degrees, distance) == expected


def test_an_item_at_15_or_345_degrees_is_visible_only_if_boundaries_are_closed() -> None:
    # The distance along y at 15 degrees in float32, for a distance of 1 along x.
    ray = float(np.float32(math.tan(math.radians(15))))
    for boundaries, expected in (("closed", FRONT), ("open", NOTHING)):
        changes = {"senses": {"boundaries": boundaries}, "contact": {"reach": 0.01}}
        assert sense_at_birth((0, 0), (1, ray), **changes) == expected
        assert sense_at_birth((0, ray), (1, 0), **changes) == expected


def test_no_sensor_reaches_45_degrees() -> None:
    for boundaries in ("closed", "open"):
        assert sense_at_birth((100, 80), (110, 90), senses={"boundaries": boundaries}) == NOTHING
        assert sense_at_birth((100, 80), (110, 70), senses={"boundaries": boundaries}) == NOTHING


@pytest.mark.parametrize("radius", [40, 4, 10, 20])
def test_an_item_is_visible_up_to_the_visual_radius(radius: float) -> None:
    senses = {"visual_radius": radius}
    assert sense_at_birth((100, 80), (100 + radius, 80), senses=senses) == FRONT
    assert sense_at_birth((100, 80), (100 + radius + 2**-14, 80), senses=senses) == NOTHING


def test_agents_see_across_the_edges_of_the_map() -> None:
    assert sense_at_birth((199, 80), (19, 80)) == FRONT
    # The item is 20 to the right and 12 down.
    assert sense_at_birth((199, 159), (19, 11)) == RIGHT
    assert sense_at_birth((199, 1), (19, 149)) == LEFT
    # The item is behind the agent.
    assert sense_at_birth((1, 80), (181, 80)) == NOTHING


def test_several_sensors_can_be_active_at_once() -> None:
    front = (120, 80)
    right = (120, 92)
    left = (120, 68)
    behind = (80, 80)
    assert sense_at_birth((100, 80), front, right, left, behind) == [1, 1, 1]
    assert sense_at_birth((100, 80), right, left) == [1, 0, 1]
    assert sense_at_birth((100, 80), behind, front, front) == FRONT
    assert sense_at_birth((100, 80)) == NOTHING
