"""Calls with one element of a batch of named tuples."""

from __future__ import annotations

from collections import namedtuple
from typing import Any, ClassVar, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.engine.elements import for_element, select_element
from baldwinlab.engine.jit import cached_jit, compiled
from baldwinlab.engine.phases import make_part_type, per_agent

Empty = namedtuple("Empty", [])


class _Scale:
    """A part with a declared array, a derived array and a setting."""

    arrays: ClassVar = {"offsets": per_agent()}


Scale = make_part_type(_Scale, ["factor", "table", "offsets"])


class Values(NamedTuple):
    numbers: npt.NDArray[np.float64]  # [index].
    pair: tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]
    scale: Any
    empty: Empty


@compiled
def _write_sum(factor: float, values: Values, results: npt.NDArray[np.float64], index: int) -> None:
    first, second = values.pair
    scale = values.scale
    total = values.numbers.sum() + first[0] + second[1] + scale.offsets[0] + scale.table[2]
    results[index] = factor * total * scale.factor


_write_sum_of_element = for_element(_write_sum)


def write_sums(factor: float, batch: Values, results: npt.NDArray[np.float64]) -> None:
    for index in range(results.size):
        _write_sum_of_element(factor, batch, index, results, index)


def make_batch(length: int) -> Values:
    numbers = np.arange(3.0 * length).reshape(length, 3)
    return Values(
        numbers=numbers,
        pair=(numbers[:, :1] * 7, np.arange(2 * length).reshape(length, 2)),
        scale=Scale(factor=0.5, table=np.array([1.0, 2.0, 40.0]), offsets=numbers[:, :1] - 1),
        empty=Empty(),
    )


def test_each_call_gets_the_arrays_of_its_element_and_the_constants_of_the_parts() -> None:
    batch = make_batch(4)
    expected = [
        2.0 * 0.5 * (batch.numbers[i].sum() + 7 * 3.0 * i + (2 * i + 1) + (3.0 * i - 1) + 40.0)
        for i in range(4)
    ]
    for write in (write_sums, cached_jit(write_sums)):
        results = np.full(4, np.nan)
        write(2.0, batch, results)
        assert results.tolist() == expected


def test_a_selected_element_shares_its_arrays_with_the_batch() -> None:
    batch = make_batch(2)
    element = select_element(batch, 1)
    element.numbers[0] = -5
    element.scale.offsets[0] = -6
    assert (batch.numbers[1, 0], batch.scale.offsets[1, 0]) == (-5, -6)
    assert element.scale.table is batch.scale.table
    assert element.pair[1].tolist() == [2, 3]
