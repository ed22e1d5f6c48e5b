"""Test that the compiled learning rules and inheritance parts of the library pass all checks."""

from __future__ import annotations

import pytest

from baldwinlab.api.checks import REQUIREMENTS
from baldwinlab.experiment import registry
from baldwinlab.experiment.registry import LIBRARY
from tests.oracles.parts import check_built_in_parts

CHECKED = [name for name in REQUIREMENTS if name != "speed"]
PARTS = [(kind, name) for kind in ("learning rule", "inheritance") for name in LIBRARY[kind]]


# The compilation of each part takes a minute.
@pytest.mark.nightly
@pytest.mark.parametrize(("kind", "name"), PARTS)
def test_a_part_passes_all_checks(kind: str, name: str) -> None:
    findings = check_built_in_parts(registry.find_class(kind, name), requirements=CHECKED)
    assert all(finding.holds is not False for finding in findings), "\n".join(map(str, findings))
