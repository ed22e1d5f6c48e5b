"""Checks of the numbers that a user gives, in arguments and in environment variables.

An argument for a count, a seed, a run, a generation or an agent has the same name in all functions,
so the range of each name is defined once.
"""

from __future__ import annotations

import inspect
import operator
import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import wraps
from typing import Any, Final, ParamSpec, TypeVar

from baldwinlab.core.errors import ArgumentError, RefusedError

SEED_LIMIT: Final = 2**31
"""Limit of seeds and run numbers (exclusive), because records hold signed 32-bit integers."""
INDICES: Final = frozenset({"agent", "generation", "run", "seed", "world"})
"""Names of arguments that are an index or a seed, at least 0."""
COUNTS: Final = frozenset(
    {"count", "generations", "last", "lives", "runs", "steps", "workers", "worlds"}
)
"""Names of arguments that are a count, at least 1."""

_Parameters = ParamSpec("_Parameters")
_Result = TypeVar("_Result")


def format_count(number: int | str, noun: str) -> str:
    """Return a number or a range with its noun, such as "1 run", "1,000 runs" or "8 to 20 runs"."""
    text = number if isinstance(number, str) else f"{number:,}"
    return f"{text} {noun}" if text == "1" else f"{text} {noun}s"


def require_whole_number(name: str, value: Any, last: int | None = None) -> int:
    """Check an integer, for example an integer of NumPy, and return it as an int.

    `name`: name of the argument, one of `INDICES` and `COUNTS`. It determines the smallest valid
    number. `last`: the largest valid number, by default the limit of all records.
    """
    first = 1 if name in COUNTS else 0
    if last is None:
        last = SEED_LIMIT if name in COUNTS else SEED_LIMIT - 1
    try:
        # A bool is an integer in Python, but it is not a valid number here.
        number = None if isinstance(value, bool) else operator.index(value)
    except TypeError:
        number = None
    if number is None or not first <= number <= last:
        shown_value = value if number is None else number
        raise ArgumentError(name, shown_value, f"must be a whole number from {first} to {last}")
    return number


def check_numbers(function: Callable[_Parameters, _Result]) -> Callable[_Parameters, _Result]:
    """Decorate a function: check its arguments in `INDICES` and `COUNTS` before each call.

    The function receives each number as an int. An argument can be None if its annotation contains
    None, and several numbers if the annotation contains Sequence.
    """
    signature = inspect.signature(function)
    annotations = {
        name: str(parameter.annotation)
        for name, parameter in signature.parameters.items()
        if name in INDICES | COUNTS
    }

    @wraps(function)
    def check_and_call(*args: _Parameters.args, **kwargs: _Parameters.kwargs) -> _Result:
        try:
            bound = signature.bind(*args, **kwargs)
        except TypeError:
            # The call raises a TypeError that names the missing or unknown argument.
            return function(*args, **kwargs)
        for name, annotation in annotations.items():
            if name in bound.arguments:
                value = bound.arguments[name]
                bound.arguments[name] = _check_argument(name, value, annotation)
        return function(*bound.args, **bound.kwargs)

    return check_and_call


def _check_argument(name: str, value: Any, annotation: str) -> Any:
    if value is None and "None" in annotation:
        return None
    has_several = "Sequence" in annotation and isinstance(value, Iterable)
    # A NumPy array without dimensions (`ndim` = 0) is a single number.
    if has_several and not isinstance(value, str) and getattr(value, "ndim", True):
        return [require_whole_number(name, number) for number in value]
    return require_whole_number(name, value)


def read_whole_number(name: str, default: int, last: int) -> int:
    """Return the number in an environment variable, from 1 to `last`."""
    value = os.environ.get(name, str(default))
    is_number = value.isascii() and value.isdecimal()
    if not is_number or not 1 <= int(value) <= last:
        raise RefusedError(
            f"the environment variable {name} is {value!r} and must be a whole number from 1 to "
            f"{last}; correct or unset it"
        )
    return int(value)


@contextmanager
def name_variable_in_errors(name: str) -> Iterator[None]:
    """Name an environment variable in the error of a library that reads it when it is imported."""
    try:
        yield
    except ValueError as error:
        if name not in os.environ:
            raise
        raise RefusedError(
            f"the environment variable {name} is {os.environ[name]!r}: {error} Correct or unset it."
        ) from None
