"""The operators of models agree with their oracles, draw by draw."""

from __future__ import annotations

import pytest

from baldwinlab.experiment.registry import find_class
from tests.oracles.parts import check_built_in_parts

OPERATORS = [
    *("variation bit-flips", "variation few-mutations", "variation four-bit-weights"),
    *("variation lattice-steps", "variation one-point-alleles", "variation one-point-bits"),
    *("selection best-copies", "selection larger-tournament", "selection mutant-fixation"),
    "model cue-learners, variation one-point-of-units",
]


@pytest.mark.parametrize("names", OPERATORS)
def test_an_operator_agrees_with_its_oracle(names: str) -> None:
    parts = [find_class(*name.split()) for name in names.split(", ")]
    findings = check_built_in_parts(parts, requirements=("oracle",))
    assert [str(finding) for finding in findings if finding.holds is False] == []
    assert any(finding.holds for finding in findings)
