"""Test that tuples have the memory layout of a C compiler for wasm32."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import typeof

from baldwinlab.engine import wasm
from baldwinlab.engine.jit import cached_jit
from baldwinlab.engine.reference import as_pointer, dereference

# Two addresses, the number of items, the item size, the address of the first item, padding.
ARRAY = 4 + 4 + 8 + 8 + 4 + 4


class Inner(NamedTuple):
    flag: bool
    rate: np.float32
    step: int


class Outer(NamedTuple):
    numbers: Any
    inner: Inner
    pairs: Any
    share: float


def test_the_fields_of_a_tuple_have_the_offsets_of_a_c_compiler() -> None:
    outer = Outer(
        np.zeros((2, 3)), Inner(True, np.float32(1), 2), (Inner(False, np.float32(0), 1),) * 2, 0.5
    )
    size, offsets = wasm.memory_offsets(typeof(outer))
    assert offsets["numbers"] == 0
    # The shape and the strides of the array are between the array and the first field.
    first = ARRAY + 4 * 8
    assert [offsets[f"inner.{name}"] - first for name in ("flag", "rate", "step")] == [0, 4, 8]
    assert offsets["pairs.1.rate"] - offsets["pairs.0.rate"] == 16
    assert (offsets["share"], size) == (first + 3 * 16, first + 3 * 16 + 8)


def _doubled(numbers: Any, factor: float) -> None:
    outer = dereference(as_pointer(Outer(numbers, Inner(True, np.float32(1), 2), (1, 2), factor)))
    for index in range(outer.numbers.size):
        outer.numbers[index] *= outer.share * outer.inner.step


def test_compiled_code_reads_a_tuple_from_its_address() -> None:
    numbers = np.arange(3.0)
    cached_jit(_doubled)(numbers, 1.5)
    assert numbers.tolist() == [0, 3, 6]
