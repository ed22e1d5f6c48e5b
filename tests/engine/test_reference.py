"""A tuple's address, in compiled code, is the tuple."""

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
    there = as_pointer(pair)
    for index in range(there.numbers.size):
        there.numbers[index] = there.numbers[index] * there.factor


def test_what_is_done_through_an_address_is_done_to_the_arrays_of_the_tuple() -> None:
    numbers = np.arange(4.0)
    cached_jit(_scaled)(Pair(numbers, 3.0))
    assert numbers.tolist() == [0, 3, 6, 9]


def test_addresses_of_states_with_other_parts_are_of_different_types_even_where_their_fields_have_the_same_names() -> (
    None
):
    learns, does_not = (
        typeof(make_state(Experiment().replace(learning={"rule": rule}), 1))
        for rule in ("self-taught", "none")
    )
    assert str(learns.types[-4]) == str(does_not.types[-4])  # two rules without arrays of their own
    assert Reference(learns) != Reference(does_not)
    assert Reference(learns) == Reference(learns)
