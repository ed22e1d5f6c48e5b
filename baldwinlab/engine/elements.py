"""Calls of compiled functions with one element of a batch of named tuples.

The arrays of a batch have a first dimension, whose index selects the element: the state of a block
of worlds, or the lifetimes of a run. So one call from Python serves all elements.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import types

from baldwinlab.engine.jit import register
from baldwinlab.engine.numba_internals.lowering import (
    BaseNamedTuple,
    BaseTuple,
    named_tuple_class,
)


def for_element(function: Callable[..., None]) -> Callable[..., None]:
    """Return a function that calls `function` with one element of a batch.

    Compiled code calls `function(first, element, *arguments)` as `for_element(function)(first,
    batch, index, *arguments)`. A function that returns the element would have to count references
    to its arrays, so the element is created at the place of the call.
    """

    def generic(first: Any, batch: Any, index: int, *arguments: Any) -> None:
        function(first, select_element(batch, index), *arguments)

    def choose(first: Any, batch: Any, index: Any, *arguments: Any) -> Any:
        names: dict[str, Any] = {"function": function}
        element = _element_source(batch, "batch", names)
        source = f"lambda first, batch, index, *rest: function(first, {element}, *rest)"
        return eval(source, names)

    return register(generic, choose)


def select_element(batch: Any, index: int) -> Any:
    """Return one element of a batch, whose arrays are views."""
    if isinstance(batch, np.ndarray):
        return batch[index]
    if not isinstance(batch, tuple):
        return batch
    fields = getattr(batch, "_fields", range(len(batch)))
    entries = [
        select_element(entry, index) if _has_elements(type(batch), field) else entry
        for field, entry in zip(fields, batch, strict=True)
    ]
    return type(batch)._make(entries) if hasattr(batch, "_make") else tuple(entries)


def _element_source(kind: Any, path: str, names: dict[str, Any]) -> str:
    """Return the expression of the element of a value at `path`. `names` are its global names."""
    if isinstance(kind, types.Array):
        return f"{path}[index]"
    if not isinstance(kind, BaseTuple) or len(kind) == 0:
        return path
    if not isinstance(kind, BaseNamedTuple):
        entries = [
            _element_source(entry, f"{path}[{number}]", names) for number, entry in enumerate(kind)
        ]
        return f"({', '.join(entries)},)"
    tuple_class = named_tuple_class(kind)
    entries = [
        _element_source(entry, f"{path}.{field}", names)
        if _has_elements(tuple_class, field)
        else f"{path}.{field}"
        for field, entry in zip(kind.fields, kind, strict=True)
    ]
    name = f"Tuple{len(names)}"
    names[name] = tuple_class
    return f"{name}({', '.join(entries)})"


def _has_elements(tuple_class: Any, field: Any) -> bool:
    """Return whether each element has its own value of a field.

    A part declares its arrays. Its other fields are settings and derived values, which all elements
    share.
    """
    part = getattr(tuple_class, "part", None)
    return part is None or field in part.arrays
