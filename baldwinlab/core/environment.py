"""Environment variables with numbers: their check, and errors of libraries that read them."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

from baldwinlab.core.errors import RefusedError


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
