"""Test that code that reads unwritten memory has results that depend on the poison pattern."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from baldwinlab.engine import poison
from baldwinlab.parts import load_file
from baldwinlab.simulation.replay import replay
from tests.engine.processes import run_python
from tests.worlds import make_small_experiment


@pytest.mark.parametrize(
    "dtype", ["float32", "float64", "int8", "int32", "int64", "uint8", "uint32", "bool"]
)
def test_unwritten_memory_differs_between_the_two_patterns(dtype: str) -> None:
    arrays = []
    for number in poison.PATTERNS:
        with poison.use_pattern(number):
            arrays.append(poison.empty((3, 4), dtype))
    assert (arrays[0] != arrays[1]).all()
    assert all(
        array.shape == (3, 4) and array.dtype == dtype and array.flags.c_contiguous
        for array in arrays
    )


def test_without_poison_no_array_is_filled() -> None:
    array = np.arange(5.0)
    with poison.use_pattern(0):
        poison.fill(array)
        assert not poison.is_on()
    assert (array == np.arange(5.0)).all()


@pytest.mark.parametrize("number", poison.PATTERNS)
def test_an_unwritten_index_stays_in_the_margins_of_an_array(number: int) -> None:
    with poison.use_pattern(number):
        index = int(poison.empty(1, np.int64)[0])
        array = poison.empty((2, 100), np.float32)
    assert array.base is not None
    assert array.base.nbytes > 2 * abs(index) * array.strides[0] + array.nbytes


@pytest.mark.parametrize(
    ("value", "printed"), [("2", "2"), ("", "0"), ("0", "0"), ("3", "must be 0 (off), 1 or 2")]
)
def test_the_environment_chooses_the_pattern(value: str, printed: str) -> None:
    code = "from baldwinlab.engine import poison; print(poison.pattern_number())"
    done = run_python(code, environment={poison.ENVIRONMENT_VARIABLE: value}, check=False)
    assert printed in done.stdout + done.stderr


READS_UNSET = """
from baldwinlab.parts import LearningRule, get, per_agent, put


class ReadsUnset(LearningRule, name="reads-unset"):
    arrays = {{"trace": per_agent("weights")}}

    @staticmethod
    def init_agent(part, model, state, world, agent):
        for weight in range({first}, state.weights.shape[0]):
            part.trace[weight, world * model.agents + agent] = 0

    @staticmethod
    def learn(part, model, state, step, lane):
        put(state.weights, 0, lane, get(state.weights, 0, lane) + get(part.trace, 0, lane))
"""


@pytest.mark.parametrize(("first", "is_same"), [(0, True), (1, False)])
def test_a_rule_that_reads_unwritten_memory_has_results_that_depend_on_the_pattern(
    first: int, is_same: bool, tmp_path: Path, in_plain_python: None
) -> None:
    (tmp_path / "part.py").write_text(READS_UNSET.format(first=first))
    load_file(tmp_path / "part.py")
    weights = []
    for number in poison.PATTERNS:
        with poison.use_pattern(number):
            experiment = make_small_experiment(
                "evo", learning={"rule": "reads-unset"}, lifetime={"steps": 3}
            )
            lifetime = replay(experiment, seed=1, generation=0)
            weights.append(lifetime["weight_death"].values.tobytes())
    assert (weights[0] == weights[1]) is is_same
