"""The contract of a real-valued sense of one's own: numbers from 0 to 1, those of its oracle, and of nobody else."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

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
    def measure(part, model, state, world, agent, first):
        lane = world * model.agents + agent
        state.activations[first, lane] = {measured}

    @staticmethod
    def oracle(part, agent, items, naive):
        return [agent.y / naive.height]
"""
HONEST = "state.positions[1, lane] / model.height"


@pytest.fixture(autouse=True)
def _forgotten(without_compilation: None) -> Iterator[None]:
    yield
    registry.remove("sense", "height")


def failures(tmp_path: Path, measured: str) -> str:
    (tmp_path / "height.py").write_text(SENSE.format(measured=measured))
    with np.errstate(all="ignore"):  # random words wrap around, as they should
        found: Any = bl.check_part(
            tmp_path / "height.py", requirements=["fields", "others", "oracle"]
        )
    return "\n".join(str(each) for each in found if each.holds is False)


def test_who_tells_the_truth_keeps_the_contract(tmp_path: Path) -> None:
    assert failures(tmp_path, HONEST) == ""


def test_numbers_beyond_0_and_1_are_found(tmp_path: Path) -> None:
    assert "each must be at least 0 and at most 1" in failures(tmp_path, "state.positions[1, lane]")


def test_an_oracle_that_disagrees_is_found(tmp_path: Path) -> None:
    assert "and by the oracle" in failures(tmp_path, f"np.float32(0.99) * {HONEST}")


def test_a_look_at_a_neighbour_is_refused_before_it_runs(tmp_path: Path) -> None:
    path = tmp_path / "height.py"
    path.write_text(SENSE.format(measured="state.positions[1, lane + 1] / model.height"))
    with pytest.raises(PartError, match=r"Height\.measure reads or writes other agents"):
        load_file(path)
