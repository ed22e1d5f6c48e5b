"""Fingerprints of functions, which identify compiled code in the cache and during compilation."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any, Final

import numpy as np

_PACKAGE: Final = Path(__file__).parents[1]


def fingerprint(functions: Iterable[Callable[..., Any]]) -> str:
    """Hash the code and constants of functions in memory, and of all functions that they call."""
    digest = hashlib.sha256()
    visited = set[int]()
    for function in functions:
        for piece in _pieces(function, visited, _code_pieces):
            digest.update(piece.encode() + b"\0")
    return digest.hexdigest()[:16]


def position_fingerprint(functions: Sequence[Callable[..., Any]]) -> str:
    """Hash the positions of functions in the package, and of all functions that they call.

    The hash is the same for all versions of Python. It identifies functions only among equal source
    files. For a function outside the package, it contains the code.
    """
    visited = set[int]()
    pieces = {
        piece for function in functions for piece in _pieces(function, visited, _position_pieces)
    }
    names = [f"{function.__module__}.{function.__qualname__}" for function in functions]
    return hashlib.sha256("\0".join([*names, *sorted(pieces)]).encode()).hexdigest()[:16]


def python_of(function: Any) -> Any:
    """Return the Python function of a compiled function, or the function itself."""
    return getattr(function, "py_func", function)


def _pieces(
    value: Any, visited: set[int], describe: Callable[[CodeType], Iterator[str]]
) -> Iterator[str]:
    value = python_of(value)
    if isinstance(value, FunctionType):
        if id(value) not in visited:
            visited.add(id(value))
            closure_values = [cell.cell_contents for cell in value.__closure__ or ()]
            yield f"{value.__module__}.{value.__qualname__}"
            yield from describe(value.__code__)
            for used in (*_used_globals(value.__code__, value.__globals__), *closure_values):
                yield from _pieces(used, visited, describe)
    elif isinstance(value, type):
        # The cache of Numba identifies argument types by this name.
        yield f"{value.__module__}.{value.__qualname__}"
    elif isinstance(value, int | float | str | bytes | tuple | np.generic):
        yield repr(value)


def _code_pieces(code: CodeType) -> Iterator[str]:
    yield code.co_code.hex()
    yield repr(code.co_names)
    for constant in code.co_consts:
        yield from _code_pieces(constant) if isinstance(constant, CodeType) else (repr(constant),)


def _position_pieces(code: CodeType) -> Iterator[str]:
    path = Path(code.co_filename)
    if path.is_relative_to(_PACKAGE):
        yield f"{path.relative_to(_PACKAGE).as_posix()}:{code.co_firstlineno}"
    else:
        yield from _code_pieces(code)


def _used_globals(code: CodeType, namespace: dict[str, Any]) -> Iterator[Any]:
    for name in code.co_names:
        value = namespace.get(name)
        # A function of a module, such as `np.float32`.
        if isinstance(value, ModuleType):
            members = (vars(value).get(attribute) for attribute in code.co_names)
            yield from (member for member in members if isinstance(member, FunctionType))
        elif value is not None:
            yield value
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _used_globals(constant, namespace)
