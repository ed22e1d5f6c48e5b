"""Rules of the library, and what elders pass on, keep the contract of a part, compiled."""

from __future__ import annotations

import pytest

import baldwinlab as bl
from baldwinlab.api.checks import REQUIREMENTS
from baldwinlab.experiment import registry
from baldwinlab.experiment.registry import LIBRARY

TRIED = [name for name in REQUIREMENTS if name != "speed"]
PARTS = [(kind, name) for kind in ("learning rule", "inheritance") for name in LIBRARY[kind]]


@pytest.mark.nightly  # each takes a minute to be compiled, under both updates
@pytest.mark.parametrize(("kind", "name"), PARTS)
def test_a_part_keeps_the_contract(kind: str, name: str) -> None:
    found = bl.check_part(registry.find(kind, name), requirements=TRIED)
    assert all(each.holds is not False for each in found), "\n".join(map(str, found))
