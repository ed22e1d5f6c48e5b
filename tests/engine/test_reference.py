"""Test that compiled code reads and writes a tuple through its address."""

from typing import Any, NamedTuple

import numpy as np
from numba import typeof

from baldwinlab.engine.jit import cached_jit
from baldwinlab.engine.reference import Reference, as_pointer
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.allocation import make_state


class Pair(NamedTuple):
    numbers: Any
    factor: float


def _scaled(pair: Any) -> None:
    pointer = as_pointer(pair)
    for index in range(pointer.numbers.size):
        pointer.numbers[index] = pointer.numbers[index] * pointer.factor


def test_code_writes_to_the_arrays_of_a_tuple_through_its_address() -> None:
    numbers = np.arange(4.0)
    cached_jit(_scaled)(Pair(numbers, 3.0))
    assert numbers.tolist() == [0, 3, 6, 9]


def test_addresses_of_states_with_different_parts_have_different_types() -> None:
    learning, innate = (
        typeof(make_state(Experiment().replace(learning={"rule": rule}), 1))
        for rule in ("self-taught", "none")
    )
    # Both rules have no arrays, so their fields have the same names.
    assert str(learning.types[-4]) == str(innate.types[-4])
    assert Reference(learning) != Reference(innate)
    assert Reference(learning) == Reference(learning)
