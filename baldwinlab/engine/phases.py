"""Hooks: functions that every part of a kind has, selected by the type of the part at compile time.

In compiled code a part is a NamedTuple. The attribute `part` of its class is the class that holds
the hooks as static methods. The first argument of a hook is the part: `learn(rule, model, state,
step, lane)`. Numba compiles the function of the part at the place of the call, without branch or
indirection. Plain Python and the GPU simulator look the function up instead.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any, NamedTuple

from baldwinlab.engine.jit import compiled, register
from baldwinlab.engine.numba_internals.lowering import named_tuple_class


def part_class(kind: Any) -> Any:
    """Return the class with the hooks of a part, by Numba's type of the part."""
    return named_tuple_class(kind).part


def hook(default: Callable[..., Any]) -> Any:
    """Return a hook with the name and docstring of `default`, which parts inherit."""

    @wraps(default)
    def generic(part: Any, *arguments: Any) -> Any:
        return getattr(type(part).part, default.__name__)(part, *arguments)

    def choose(part: Any, *arguments: Any) -> Any:
        return getattr(part_class(part), default.__name__)

    generic.default = default  # type: ignore[attr-defined]
    return register(generic, choose)


def for_each(
    hook_function: Callable[..., Any], nothing: Any, join: Callable[[Any, Any], Any]
) -> Callable[..., Any]:
    """Return a function that calls a hook for each part of a tuple and joins the results.

    Parameters
    ----------
    hook_function : Callable
        The hook.
    nothing : Any
        Result for an empty tuple.
    join : Callable
        Function that joins two results.
    """

    def generic(parts: Any, *arguments: Any) -> Any:
        result = nothing
        for number, part in enumerate(parts):
            value = hook_function(part, *arguments)
            result = value if number == 0 else join(result, value)
        return result

    def choose(parts: Any, *arguments: Any) -> Any:
        if len(parts) == 0:
            return lambda parts, *arguments: nothing
        if len(parts) == 1:
            return lambda parts, *arguments: hook_function(parts[0], *arguments)
        return lambda parts, *arguments: join(
            hook_function(parts[0], *arguments), generic(parts[1:], *arguments)
        )

    return register(generic, choose)


@compiled
def _nothing(first: None, second: None) -> None:
    return None


def for_each_part(hook_function: Callable[..., None]) -> Callable[..., None]:
    """Return a function that calls a hook without result for each part of a tuple."""
    return for_each(hook_function, None, _nothing)


def select_by_type(
    if_any: Callable[..., Any],
    if_none: Callable[..., Any],
    condition: Callable[[Any], bool] = lambda holder: True,
) -> Callable[..., Any]:
    """Return a function that calls `if_any` or `if_none`, by the types of the parts in a tuple.

    It calls `if_any` if `condition` is true for the class of any part.
    """

    def generic(parts: Any, *arguments: Any) -> Any:
        is_any = any(condition(type(part).part) for part in parts)
        return (if_any if is_any else if_none)(parts, *arguments)

    def choose(parts: Any, *arguments: Any) -> Any:
        is_any = any(condition(part_class(part)) for part in parts)
        selected = if_any if is_any else if_none
        return lambda parts, *arguments: selected(parts, *arguments)

    return register(generic, choose)


def hook_functions(holder: type) -> tuple[Callable[..., Any], ...]:
    """Return the static methods of a class and its bases: the hooks of a part."""
    names = {
        name: None
        for cls in holder.__mro__
        for name, value in vars(cls).items()
        if isinstance(value, staticmethod)
    }
    return tuple(getattr(holder, name) for name in names)


class Array(NamedTuple):
    """Declaration of an array of a part or of the step, from which backends derive its layout.

    Attributes
    ----------
    owner : str
        "agent": [*rows, lane]. "lane": [lane, *rows]. "world": [world, *rows]. "batch": [*rows].
    rows : tuple of int or str
        Sizes: numbers, or names of dimensions.
    dtype : str
        Type of the entries.
    fill : float or None
        Initial value, set once for all generations. None: undefined.
    """

    owner: str
    rows: tuple[int | str, ...] = ()
    dtype: str = "float32"
    fill: float | None = None


def per_agent(*rows: int | str, dtype: str = "float32", fill: float | None = None) -> Array:
    """Declare an array [row, lane] with a column for each agent.

    Parameters
    ----------
    *rows : int or str
        Sizes of the other dimensions: numbers, or "weights", "units", "inputs", "actions".
        One row by default.
    dtype : str
        Type of the entries. SIMD blocks need "float32".
    fill : float or None
        Initial value, set once. None: undefined, so that each lifetime must write an entry
        before it reads it.
    """
    return Array("agent", rows or (1,), dtype, fill)


def per_lane(*rows: int | str, dtype: str = "float32", fill: float | None = None) -> Array:
    """Declare an array [lane, row], in which the rows of an agent are contiguous in memory.

    It is faster than `per_agent` for lookups by agent. The parameters are those of `per_agent`.
    """
    return Array("lane", rows or (1,), dtype, fill)


def per_world(*rows: int | str, dtype: str = "float32", fill: float | None = None) -> Array:
    """Declare an array [world, *rows]. The parameters are those of `per_agent`."""
    return Array("world", rows or (1,), dtype, fill)
