"""The contract of a custom real-valued sense: inputs are finite and agree with the oracle."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.experiment import registry
from baldwinlab.parts import PartError, load_file

SENSE = """
import numpy as np
from baldwinlab.parts import Sense, per_agent

class Height(Sense, name="height"):
    inputs = ("height",)
    sectors = (None,)
    is_continuous = True

    @staticmethod
    def measure(part, model, state, world, agent):
        lane = world * model.agents + agent
        state.activations[part.first_input, lane] = {measured}

    @staticmethod
    def oracle(part, agent, items, naive):
        return [{expected}]
"""
CORRECT = "state.positions[1, lane] / model.height"


@pytest.fixture(autouse=True)
def _remove_sense(without_compilation: None) -> Iterator[None]:
    yield
    registry.remove("sense", "height")


def failures(tmp_path: Path, measured: str, expected: str = "agent.y / naive.height") -> str:
    (tmp_path / "height.py").write_text(SENSE.format(measured=measured, expected=expected))
    requirements = ["fields", "isolation", "oracle"]
    # The words of the random number generator overflow by design.
    with np.errstate(all="ignore"):
        findings = bl.check_part(tmp_path / "height.py", requirements=requirements)
    return "\n".join(str(finding) for finding in findings if finding.holds is False)


def test_an_input_can_be_any_finite_number_that_agrees_with_the_oracle(tmp_path: Path) -> None:
    assert failures(tmp_path, CORRECT) == ""
    assert failures(tmp_path, "-state.positions[1, lane]", "-agent.y") == ""
    is_infinite = failures(tmp_path, "np.float32(np.inf)", "float('inf')")
    assert "each must be a finite number" in is_infinite
    assert "and by the oracle" in failures(tmp_path, f"np.float32(0.99) * {CORRECT}")


def test_a_sense_that_reads_a_neighbor_is_refused_before_it_runs(tmp_path: Path) -> None:
    path = tmp_path / "height.py"
    path.write_text(
        SENSE.format(measured="state.positions[1, lane + 1] / model.height", expected="0.0")
    )
    with pytest.raises(PartError, match=r"Height\.measure reads or writes other agents"):
        load_file(path)
