"""Test that compiled senses and bodies of the library pass all checks, in combination."""

from __future__ import annotations

import pytest

from baldwinlab.models.miniworld.bodies.kinematic import Continuous, Grid, Stay
from baldwinlab.models.miniworld.senses.binary import Neighbours
from baldwinlab.models.miniworld.senses.food_rays import FoodRays
from baldwinlab.models.miniworld.senses.real_valued import EnergySense, Nearest, Rays, Smell
from baldwinlab.parts import Part
from tests.oracles.parts import check_built_in_parts

COMBINATION: list[type[Part]] = [Nearest, Smell, EnergySense, Rays, FoodRays, Neighbours, Stay]


@pytest.mark.nightly
@pytest.mark.parametrize(
    "parts", [COMBINATION, [Nearest, Grid], [Continuous]], ids=["combination", "grid", "continuous"]
)
def test_the_parts_pass_all_checks(parts: list[type[Part]]) -> None:
    assert [str(finding) for finding in check_built_in_parts(parts) if finding.holds is False] == []
