"""Real-valued senses, the sense of others and bodies of the library keep the contract of a part, compiled and together."""

from __future__ import annotations

import pytest

from baldwinlab.api.checks import check_part
from baldwinlab.models.miniworld.bodies.kinematic import Continuous, Grid, Stay
from baldwinlab.models.miniworld.senses.binary import Neighbours
from baldwinlab.models.miniworld.senses.real_valued import EnergySense, Nearest, Rays, Smell
from baldwinlab.parts import Part

TOGETHER: list[type[Part]] = [Nearest, Smell, EnergySense, Rays, Neighbours, Stay]


@pytest.mark.nightly
@pytest.mark.parametrize(
    "parts", [TOGETHER, [Nearest, Grid], [Continuous]], ids=["together", "grid", "continuous"]
)
def test_every_requirement_of_a_part_holds(parts: list[type[Part]]) -> None:
    assert [str(found) for found in check_part(parts) if found.holds is False] == []
