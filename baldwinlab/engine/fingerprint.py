"""What functions do, as a hash: by which compiled code is known, on disk and while it is made."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator
from types import CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np


def fingerprint(functions: Iterable[Callable[..., Any]]) -> str:
    """A hash of what functions do, as they are in memory: their code and constants, and so on through all that they call."""
    digest, seen = hashlib.sha256(), set[int]()
    for function in functions:
        for piece in _pieces(function, seen):
            digest.update(piece.encode() + b"\0")
    return digest.hexdigest()[:16]


def python_of(function: Any) -> Any:
    """The Python function that a compiled one was made of, or the function itself."""
    return getattr(function, "py_func", function)


def _pieces(value: Any, seen: set[int]) -> Iterator[str]:
    value = python_of(value)
    if isinstance(value, FunctionType):
        if id(value) not in seen:
            seen.add(id(value))
            inside = [cell.cell_contents for cell in value.__closure__ or ()]
            yield f"{value.__module__}.{value.__qualname__}"
            yield from _of_code(value.__code__)
            for each in (*_globals_of(value.__code__, value.__globals__), *inside):
                yield from _pieces(each, seen)
    elif isinstance(value, type):
        yield f"{value.__module__}.{value.__qualname__}"  # Numba's cache names the types of arguments so
    elif isinstance(value, int | float | str | bytes | tuple | np.generic):
        yield repr(value)


def _of_code(code: CodeType) -> Iterator[str]:
    yield code.co_code.hex()
    yield repr(code.co_names)
    for constant in code.co_consts:
        yield from _of_code(constant) if isinstance(constant, CodeType) else (repr(constant),)


def _globals_of(code: CodeType, there: dict[str, Any]) -> Iterator[Any]:
    for name in code.co_names:
        value = there.get(name)
        if isinstance(value, ModuleType):  # `np.float32`, or a function of a module by its name
            yield from (
                vars(value)[each]
                for each in code.co_names
                if isinstance(vars(value).get(each), FunctionType)
            )
        elif value is not None:
            yield value
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _globals_of(constant, there)
