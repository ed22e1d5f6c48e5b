"""Operations on memory for threads that share arrays: atomic operations, barriers and prefetches.

`models/miniworld/parallel_step.py` uses them to simulate one world in several threads. In plain
Python, the operations are not atomic, so a single thread must call them.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt
from llvmlite import ir
from numba import types
from numba.extending import lower_builtin, type_callable

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.numba_internals.lowering import (
    call_function,
    cast_to_index,
    item_address,
    none_value,
)

# Rounds of waiting before a thread sleeps: about 0.1 ms, which is more than the usual wait.
ROUNDS_BEFORE_SLEEP: Final = 100_000
_INT64_BYTES: Final = 8
# System function and duration of a sleep: 1 ms on Windows, 50 microseconds on other systems.
_SLEEP: Final = ("Sleep", 1) if sys.platform == "win32" else ("usleep", 50)


class Team(NamedTuple):
    """A thread, and its team of threads that simulate the same world."""

    thread: int  # Index of this thread, from 0.
    threads: int  # Number of threads of the team.
    # Number of calls of `wait_for_team` by all threads, [1]. The threads share the array.
    arrivals: npt.NDArray[np.int64]


def atomic_add(array: Any, index: int, value: int) -> int:
    """Add `value` to `array[index]`, an int64, and return the previous value."""
    previous = int(array[index])
    array[index] += value
    return previous


def atomic_max(array: Any, index: int, value: int) -> int:
    """Set `array[index]`, an int64, to at least `value`, and return the previous value."""
    previous = int(array[index])
    array[index] = max(previous, value)
    return previous


def atomic_load(array: Any, index: int) -> int:
    """Return `array[index]`, an int64."""
    return int(array[index])


def sleep_briefly() -> None:
    """Sleep, so that other threads can use the core. Plain Python does nothing."""


@compiled
def wait_for_team(team: Team) -> None:
    """Wait until all threads of a team have called this function equally often.

    The wait is a barrier. Barrier k of a team of n threads is complete when the total number of
    calls reaches n * k.
    """
    if team.threads > 1:
        arrivals = atomic_add(team.arrivals, 0, 1) + 1
        # The next multiple of the number of threads completes this barrier.
        expected = (arrivals + team.threads - 1) // team.threads * team.threads
        rounds = 0
        while atomic_load(team.arrivals, 0) < expected:
            rounds += 1
            if rounds > ROUNDS_BEFORE_SLEEP:
                sleep_briefly()


@compiled
def share_of_thread(team: Team, first: int, end: int) -> tuple[int, int]:
    """Return (first, end) of the indices that a thread processes, of `first` to `end` - 1.

    The ranges of all threads are disjoint and cover all indices. For example, two threads divide
    the indices 0 to 9 into (0, 5) and (5, 10).
    """
    count = end - first
    return (
        first + count * team.thread // team.threads,
        first + count * (team.thread + 1) // team.threads,
    )


def _emit_atomic(operation: str) -> Callable[..., Any]:
    """Return a function that emits an atomic operation on an item of an array."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array_type, index_type, value_type = signature.args
        array, index, value = arguments
        address = item_address(context, builder, array_type, array, [(index_type, index)])
        number = cast_to_index(context, builder, value, value_type)
        return builder.atomic_rmw(operation, address, number, "seq_cst")

    return emit


def _emit_load(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    array_type, index_type = signature.args
    array, index = arguments
    address = item_address(context, builder, array_type, array, [(index_type, index)])
    return builder.load_atomic(address, "seq_cst", _INT64_BYTES)


def _emit_sleep(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    symbol, duration = _SLEEP
    int32 = ir.IntType(32)
    function_type = ir.FunctionType(int32, [int32])
    call_function(builder, symbol, function_type, [ir.Constant(int32, duration)])
    return none_value(context)


def _atomic_type(array: Any) -> Any:
    """Return the type of an atomic operation, or None for an array that is not int64."""
    return types.int64 if array.dtype == types.int64 else None


for _function, _operation in ((atomic_add, "add"), (atomic_max, "max")):
    type_callable(_function)(lambda context: lambda array, index, value: _atomic_type(array))
    lower_builtin(_function, types.Array, types.Integer, types.Integer)(_emit_atomic(_operation))
type_callable(atomic_load)(lambda context: lambda array, index: _atomic_type(array))
lower_builtin(atomic_load, types.Array, types.Integer)(_emit_load)
type_callable(sleep_briefly)(lambda context: lambda: types.void)
lower_builtin(sleep_briefly)(_emit_sleep)


def prefetch(array: Any, row: int, column: int) -> None:
    """Load `array[row, column]` into the cache, if it exists. Plain Python does nothing."""


def _emit_prefetch(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    array_type, row_type, column_type = signature.args
    array, row, column = arguments
    indices = [(row_type, row), (column_type, column)]
    address = item_address(context, builder, array_type, array, indices)
    byte_pointer, int32 = ir.IntType(8).as_pointer(), ir.IntType(32)
    # The line is read, should be in all levels of the cache, and contains data.
    is_write, locality, is_data = (ir.Constant(int32, number) for number in (0, 3, 1))
    address = builder.bitcast(address, byte_pointer)
    arguments = [address, is_write, locality, is_data]
    function_type = ir.FunctionType(ir.VoidType(), [byte_pointer, int32, int32, int32])
    call_function(builder, "llvm.prefetch.p0", function_type, arguments)
    return none_value(context)


type_callable(prefetch)(
    lambda context: lambda array, row, column: types.void if array.ndim == 2 else None
)
lower_builtin(prefetch, types.Array, types.Integer, types.Integer)(_emit_prefetch)
