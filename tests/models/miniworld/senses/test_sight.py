"""What an agent sees, item by item, at places that float32 holds exactly. Newborns look along +x; y points down."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from baldwinlab.simulation.replay import replay
from tests.worlds import make_single_agent_experiment

LEFT, FRONT, RIGHT, NOTHING = [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 0]


def seen_at_birth(
    agent: tuple[float, float], *items: tuple[float, float], **changes: Any
) -> list[int]:
    sensors: list[int] = (
        replay(make_single_agent_experiment(agent, list(items), **changes))["sensor"]
        .values[0, 0]
        .tolist()
    )
    return sensors


def seen_at(degrees: float, distance: float, **changes: Any) -> list[int]:
    angle = math.radians(degrees)
    return seen_at_birth(
        (100, 80), (100 + distance * math.cos(angle), 80 + distance * math.sin(angle)), **changes
    )


FALLS_IN = {
    0: FRONT,
    14.99: FRONT,
    15.01: RIGHT,
    44.99: RIGHT,
    315.01: LEFT,
    344.99: LEFT,
    345.01: FRONT,
}
UNSEEN = (45.01, 90, 135, 165, 180, 195, 225, 270, 314.99)


@pytest.mark.parametrize(
    ("degrees", "expected"), [*FALLS_IN.items(), *((degrees, NOTHING) for degrees in UNSEEN)]
)
@pytest.mark.parametrize("distance", [0.5, 12, 39.99])
def test_an_item_falls_in_the_sensor_of_its_angle(
    degrees: float, distance: float, expected: list[int]
) -> None:
    assert seen_at(degrees, distance) == expected


def test_an_item_at_exactly_15_or_345_degrees_is_in_front_when_boundaries_are_closed_and_unseen_when_open() -> (
    None
):
    ray = float(
        np.float32(math.tan(math.radians(15)))
    )  # 15 degrees as exactly as float32 has them, 1 ahead of the agent
    for boundaries, expected in (("closed", FRONT), ("open", NOTHING)):
        changes = {"senses": {"boundaries": boundaries}, "contact": {"reach": 0.01}}
        assert seen_at_birth((0, 0), (1, ray), **changes) == expected
        assert seen_at_birth((0, ray), (1, 0), **changes) == expected


def test_no_sensor_reaches_45_degrees() -> None:
    for boundaries in ("closed", "open"):
        assert seen_at_birth((100, 80), (110, 90), senses={"boundaries": boundaries}) == NOTHING
        assert seen_at_birth((100, 80), (110, 70), senses={"boundaries": boundaries}) == NOTHING


@pytest.mark.parametrize("radius", [40, 4, 10, 20])
def test_an_item_is_seen_to_the_visual_radius_and_no_farther(radius: float) -> None:
    senses = {"visual_radius": radius}
    assert seen_at_birth((100, 80), (100 + radius, 80), senses=senses) == FRONT
    assert seen_at_birth((100, 80), (100 + radius + 2**-14, 80), senses=senses) == NOTHING


def test_agents_see_over_the_edges_of_the_map() -> None:
    assert seen_at_birth((199, 80), (19, 80)) == FRONT
    assert seen_at_birth((199, 159), (19, 11)) == RIGHT  # 20 along, 12 down
    assert seen_at_birth((199, 1), (19, 149)) == LEFT
    assert seen_at_birth((1, 80), (181, 80)) == NOTHING  # behind


def test_several_sensors_can_answer_at_once() -> None:
    front, right, left, behind = (120, 80), (120, 92), (120, 68), (80, 80)
    assert seen_at_birth((100, 80), front, right, left, behind) == [1, 1, 1]
    assert seen_at_birth((100, 80), right, left) == [1, 0, 1]
    assert seen_at_birth((100, 80), behind, front, front) == FRONT
    assert seen_at_birth((100, 80)) == NOTHING
