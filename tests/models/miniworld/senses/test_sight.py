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

FRONT = [0, 1, 0]
NOTHING = [0, 0, 0]


def sense_at_birth(
    agent: tuple[float, float], *items: tuple[float, float], **changes: Any
) -> list[int]:
    trace = replay(make_single_agent_experiment(agent, list(items), **changes))
    inputs: list[int] = trace["sensor"].values[0, 0].tolist()
    return inputs


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
