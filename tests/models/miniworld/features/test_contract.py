"""Worlds and senses of the library keep the contract of a part, compiled and together."""

from __future__ import annotations

import pytest

from baldwinlab.api.checks import check_part
from baldwinlab.models.miniworld.features.map_features import (
    DriftingFood,
    Patches,
    RegionsInTurn,
    SlowRegrowth,
    Walls,
)
from baldwinlab.models.miniworld.senses.binary import Compass, LastAction, PatchSight, Touch
from baldwinlab.parts import Part

TOGETHER: list[type[Part]] = [
    Walls,
    Patches,
    DriftingFood,
    SlowRegrowth,
    PatchSight,
    LastAction,
    Touch,
    Compass,
]


@pytest.mark.nightly
@pytest.mark.parametrize("parts", [TOGETHER, [RegionsInTurn]], ids=["together", "in turn"])
def test_every_requirement_of_a_part_holds(parts: list[type[Part]]) -> None:
    assert [str(found) for found in check_part(parts) if found.holds is False] == []
