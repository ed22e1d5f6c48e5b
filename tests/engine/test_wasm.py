"""How tuples lie in the memory of WebAssembly: as a C compiler for wasm32 would lay them out."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import typeof

from baldwinlab.engine import wasm
from baldwinlab.engine.jit import cached_jit
from baldwinlab.engine.reference import as_pointer, dereference

ARRAY = (
    4 + 4 + 8 + 8 + 4 + 4
)  # two addresses, the number of items, their size, the address of the first, and what fills up


class Inner(NamedTuple):
    flag: bool
    rate: np.float32
    step: int


class Outer(NamedTuple):
    numbers: Any
    inner: Inner
    others: Any
    share: float


def test_each_leaf_of_a_tuple_lies_where_c_would_put_it() -> None:
    outer = Outer(
        np.zeros((2, 3)), Inner(True, np.float32(1), 2), (Inner(False, np.float32(0), 1),) * 2, 0.5
    )
    size, places = wasm.memory_offsets(typeof(outer))
    assert places["numbers"] == 0
    first = ARRAY + 4 * 8  # its shape and its strides follow
    assert [places[f"inner.{name}"] - first for name in ("flag", "rate", "step")] == [0, 4, 8]
    assert places["others.1.rate"] - places["others.0.rate"] == 16
    assert (places["share"], size) == (first + 3 * 16, first + 3 * 16 + 8)


def _doubled(numbers: Any, factor: float) -> None:
    there = dereference(as_pointer(Outer(numbers, Inner(True, np.float32(1), 2), (1, 2), factor)))
    for index in range(there.numbers.size):
        there.numbers[index] *= there.share * there.inner.step


def test_a_tuple_that_is_taken_from_its_address_is_the_tuple() -> None:
    numbers = np.arange(3.0)
    cached_jit(_doubled)(numbers, 1.5)
    assert numbers.tolist() == [0, 3, 6]
