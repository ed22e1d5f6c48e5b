"""Test that compiled world features and senses of the library pass all checks, in combination."""

from __future__ import annotations

import pytest

from baldwinlab.models.miniworld.features.food import (
    DriftingFood,
    Patches,
    RegionsInTurn,
    SlowRegrowth,
)
from baldwinlab.models.miniworld.features.walls import Walls
from baldwinlab.models.miniworld.senses.binary import Compass, LastAction, PatchSight, Touch
from baldwinlab.parts import Part
from tests.oracles.parts import check_built_in_parts

COMBINATION: list[type[Part]] = [
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
@pytest.mark.parametrize(
    "parts", [COMBINATION, [RegionsInTurn]], ids=["combination", "regions in turn"]
)
def test_the_parts_pass_all_checks(parts: list[type[Part]]) -> None:
    assert [str(finding) for finding in check_built_in_parts(parts) if finding.holds is False] == []
