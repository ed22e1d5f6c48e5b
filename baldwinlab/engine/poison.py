"""Poison: a debug mode that fills memory with a pattern before anything is written there.

The environment variable `BALDWINLAB_POISON` chooses the pattern: 0 or unset is off, 1 and 2 are two
patterns. Code that reads memory before it writes it gives other results under another pattern, so
two runs with two patterns must give the same bits. Every output and scratch buffer of lifetimes and
of reproduction is allocated by `empty` or filled by `fill`.

Integers of the patterns are small, and every poisoned array has a margin on both sides. So an index
that was never written points into the array or the margin, and not to other memory.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.core.errors import RefusedError

ENVIRONMENT_VARIABLE: Final = "BALDWINLAB_POISON"
CACHE_LINE_BYTES: Final = 64
# Minimum number of rows in the margin of a poisoned array.
MARGIN_ROWS: Final = 8


class Pattern(NamedTuple):
    """The value of unwritten memory for each kind of data type."""

    real: float
    signed: int
    unsigned: int
    boolean: bool


PATTERNS: Final = {1: Pattern(math.nan, -3, 3, True), 2: Pattern(-1e30, 4, 5, False)}

# None before the environment variable is read.
_active_pattern_number: int | None = None


def pattern_number() -> int:
    """Return the number of the pattern in use; 0 is off."""
    global _active_pattern_number
    if _active_pattern_number is None:
        value = os.environ.get(ENVIRONMENT_VARIABLE) or "0"
        if value not in ("0", *map(str, PATTERNS)):
            raise RefusedError(
                f"the environment variable {ENVIRONMENT_VARIABLE} is {value!r} "
                "and must be 0 (off), 1 or 2"
            )
        _active_pattern_number = int(value)
    return _active_pattern_number


def is_on() -> bool:
    """Return whether unwritten memory is poisoned."""
    return pattern_number() != 0


@contextmanager
def use_pattern(number: int) -> Iterator[None]:
    """Poison with pattern `number` (0 is off) in this process, until the block ends."""
    global _active_pattern_number
    previous_pattern_number = pattern_number()
    _active_pattern_number = number
    try:
        yield
    finally:
        _active_pattern_number = previous_pattern_number


def fill(array: npt.NDArray[Any]) -> None:
    """Fill `array` with the pattern. Do nothing if poison is off."""
    if is_on():
        pattern = PATTERNS[pattern_number()]
        array[...] = {
            "f": pattern.real,
            "i": pattern.signed,
            "u": pattern.unsigned,
            "b": pattern.boolean,
        }[array.dtype.kind]


def empty(shape: int | tuple[int, ...], dtype: npt.DTypeLike = np.float64) -> npt.NDArray[Any]:
    """Allocate an array as `numpy.empty` does, filled with the pattern if poison is on."""
    if not is_on():
        return np.empty(shape, dtype)
    array = allocate((shape,) if isinstance(shape, int) else tuple(shape), np.dtype(dtype))
    fill(array)
    return array


def allocate(shape: tuple[int, ...], dtype: np.dtype[Any]) -> npt.NDArray[Any]:
    """Allocate zeros that begin on a cache line, with margins if poison is on."""
    size = math.prod(shape) * dtype.itemsize
    row_bytes = math.prod(shape[1:]) * dtype.itemsize
    margin = MARGIN_ROWS * (CACHE_LINE_BYTES + row_bytes) if is_on() else 0
    buffer = np.zeros(size + CACHE_LINE_BYTES + 2 * margin, np.uint8)
    # Index of the first byte after the margin at which a cache line begins.
    first = margin + -(buffer.ctypes.data + margin) % CACHE_LINE_BYTES
    return buffer[first : first + size].view(dtype).reshape(shape)
