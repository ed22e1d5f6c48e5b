"""Test that a hook that cannot be compiled raises one sentence with the code to write instead."""

from __future__ import annotations

import linecache
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from baldwinlab.core.errors import PartError
from baldwinlab.engine import simd
from baldwinlab.engine.jit import cached_jit

HOOK = """
def learn(weights, counts, first):
    lane = simd_block(first)
    x = get(weights, 0, lane)
    mask = x > np.float32(0)
    {statement}
"""
STATEMENTS = [
    ("put(weights, 0, lane, x * 0.5)", "a SIMD block holds float32; write np.float32(0.5) for 0.5"),
    ("put(weights, 0, lane, x + 1)", "a SIMD block holds float32; write np.float32(0.5) for 0.5"),
    ("put(weights, 0, lane, 0.5)", "put stores float32; write np.float32(0.5) for 0.5"),
    ("put(weights, 0, lane, x if mask else x)", "write choose(mask, a, b), any_of(mask), & and |"),
    (
        "put(weights, 0, lane, choose(mask and x < x, x, x))",
        "so if, and, or and a < b < c cannot use it",
    ),
    ("put(weights, 0, lane, choose(not mask, x, x))", "write negated(mask)"),
    (
        "put(weights, 0, lane, choose(mask, x, 0.0))",
        "choose(mask, a, b) takes a mask, and a and b in float32",
    ),
    ("put(weights, 0, lane, choose(x == x, x, x))", "SIMD blocks cannot be compared by == or !="),
    (
        "put(weights, 0, lane, choose(x < counts[0] - 0.5, x, x))",
        "if a hook compares step with a setting, declare the setting as int: youth: int = Field(",
    ),
    (
        "put(weights, 0, lane, choose(first < 5, x, x))",
        "and if for a comparison of numbers, such as step < part.youth",
    ),
    ("put(weights, 0, lane, max(x, x))", "write choose(a > b, a, b)"),
    ("put(weights, 0, lane, np.minimum(x, x))", "write choose(a < b, a, b)"),
    ("put(weights, 0, lane, x ** 2)", "a SIMD block cannot be raised to a power; write x * x"),
    ("put(weights, 0, lane, np.exp(x))", "a SIMD block is no argument of exp; it has + - * /"),
    ("put(weights, 0, lane, abs(mask))", "a mask of a SIMD block is no argument of abs"),
    (
        "weights[0, lane] = x",
        "a SIMD block is reached by no index; write get(array, row, lane) and put(",
    ),
    (
        "put(weights, lane, 0, x)",
        "the row comes before the lane; write put(array, row, lane, value)",
    ),
    (
        "put(weights, 0, lane + 1, x)",
        "the lane is a SIMD block of agents and no number, so add does not take it",
    ),
    (
        "put(weights, 0, lane, x + get(counts, 0, lane))",
        "get reaches float32 arrays alone in a hook per agent",
    ),
]


@pytest.mark.parametrize(
    ("statement", "sentence"), STATEMENTS, ids=[statement for statement, _ in STATEMENTS]
)
def test_an_error_with_a_block_is_described_in_terms_of_the_documentation(
    tmp_path: Path, statement: str, sentence: str
) -> None:
    message = _compile(tmp_path / "rule.py", statement)
    assert message.startswith(f"learn cannot be compiled ({tmp_path / 'rule.py'}:6): ")
    assert sentence in message
    assert not re.search(r"\b(wide|lane_block|Function|signature)\b", message)
    assert len(message.splitlines()) == 1


def _compile(file: Path, statement: str) -> str:
    """Return the message about a hook with the statement."""
    file.write_text(HOOK.format(statement=statement), encoding="utf-8")
    linecache.checkcache()
    names: dict[str, Any] = {**vars(simd), "np": np, "math": math}
    exec(compile(file.read_text("utf-8"), str(file), "exec"), names)
    hook = names["learn"]
    with pytest.raises(PartError) as refused:
        cached_jit(hook, (hook,))(np.zeros((1, 16), np.float32), np.zeros((1, 16), np.int32), 0)
    return str(refused.value)
