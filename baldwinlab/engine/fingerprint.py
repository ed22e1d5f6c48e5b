"""Fingerprints of functions, which identify compiled code in the cache and during compilation."""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any, Final

import numpy as np

_PACKAGE: Final = Path(__file__).parents[1]
# Since Python 3.14. Earlier versions store None if a function has no docstring.
_HAS_DOCSTRING: Final = getattr(inspect, "CO_HAS_DOCSTRING", None)


def fingerprint(functions: Iterable[Callable[..., Any]]) -> str:
    """Hash the code and constants of functions in memory, and of all functions that they call."""
    digest = hashlib.sha256()
    for value in reach(functions):
        for piece in _describe(value, _code_pieces):
            digest.update(piece.encode() + b"\0")
    return digest.hexdigest()[:16]


def name_fingerprint(functions: Sequence[Callable[..., Any]]) -> str:
    """Hash the names of functions in the package, and of all functions that they call.

    The hash is the same for all versions of Python. It identifies functions only among equal
    sources. For a function outside the package, it contains the code.
    """
    pieces = {piece for value in reach(functions) for piece in _describe(value, _name_pieces)}
    names = [f"{function.__module__}.{function.__qualname__}" for function in functions]
    return hashlib.sha256("\0".join([*names, *sorted(pieces)]).encode()).hexdigest()[:16]


def list_modules(functions: Iterable[Callable[..., Any]]) -> set[str]:
    """Return the modules of functions, of all functions that they call, and of their parts."""
    modules: set[str] = set()
    for value in reach(functions):
        if isinstance(value, type):
            part = getattr(value, "part", None)
            classes = (*value.__mro__, *(part.__mro__ if isinstance(part, type) else ()))
            modules.update(holder.__module__ for holder in classes)
        elif isinstance(value, FunctionType):
            modules.add(value.__module__)
    return modules


def python_of(function: Any) -> Any:
    """Return the Python function of a compiled function, or the function itself."""
    return getattr(function, "py_func", function)


def reach(functions: Iterable[Any]) -> Iterator[Any]:
    """Yield functions, the functions that they call, and the types and constants that they use."""
    visited = set[int]()
    for function in functions:
        yield from _reach_value(function, visited)


def _reach_value(value: Any, visited: set[int]) -> Iterator[Any]:
    value = python_of(value)
    if isinstance(value, FunctionType):
        if id(value) not in visited:
            visited.add(id(value))
            yield value
            closure_values = [cell.cell_contents for cell in value.__closure__ or ()]
            for used in (*_used_globals(value.__code__, value.__globals__), *closure_values):
                yield from _reach_value(used, visited)
    elif isinstance(value, type | int | float | str | bytes | tuple | np.generic):
        yield value


def _describe(value: Any, describe_code: Callable[[CodeType], Iterator[str]]) -> Iterator[str]:
    if isinstance(value, FunctionType):
        yield f"{value.__module__}.{value.__qualname__}"
        yield from describe_code(value.__code__)
    elif isinstance(value, type):
        # The cache of Numba identifies argument types by this name.
        yield f"{value.__module__}.{value.__qualname__}"
    else:
        yield repr(value)


def _code_pieces(code: CodeType) -> Iterator[str]:
    yield code.co_code.hex()
    yield repr(code.co_names)
    for constant in _constants(code):
        yield from _code_pieces(constant) if isinstance(constant, CodeType) else (repr(constant),)


def _constants(code: CodeType) -> tuple[Any, ...]:
    """Return the constants of a function without its docstring, which is the first one."""
    first = code.co_consts[:1]
    is_docstring = _HAS_DOCSTRING is None or code.co_flags & _HAS_DOCSTRING
    has_docstring = bool(first) and isinstance(first[0], str) and bool(is_docstring)
    return code.co_consts[1:] if has_docstring else code.co_consts


def _name_pieces(code: CodeType) -> Iterator[str]:
    path = Path(code.co_filename)
    if path.is_relative_to(_PACKAGE):
        yield path.relative_to(_PACKAGE).as_posix()
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
