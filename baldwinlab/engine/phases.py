"""Hooks: functions that every part of a kind has, selected by the type of the part at compile time.

In compiled code, a part is a NamedTuple. The class of the NamedTuple has the attribute `part`: the
Python class with the hooks as static methods. The first argument of a hook is the part:
`learn(rule, model, state, step, lane)`. Numba compiles the hook of this part at the place of the
call, without branch or indirection. Plain Python and the GPU simulator look the hook up instead.
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable, Sequence
from functools import wraps
from typing import Any, Final, NamedTuple

from baldwinlab.engine.jit import compiled, register
from baldwinlab.engine.numba_internals.lowering import named_tuple_class


def part_class(kind: Any) -> Any:
    """Return the class with the hooks of a part, by Numba's type of the part."""
    return named_tuple_class(kind).part


def make_part_type(holder: type[Any], fields: Sequence[str]) -> Any:
    """Return the NamedTuple of a part in compiled code, with the hooks of `holder`.

    The class is also stored as `holder.Compiled`, because Numba's cache finds it by this name.
    """
    part_type: Any = namedtuple("Compiled", fields)  # type: ignore[misc]
    part_type.__module__ = holder.__module__
    part_type.__qualname__ = f"{holder.__qualname__}.Compiled"
    # mypy reads the attributes of a NamedTuple, so an assignment would be an error.
    setattr(part_type, "part", holder)  # noqa: B010
    holder.Compiled = part_type
    return part_type


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
    hook_function: Callable[..., Any], empty_result: Any, join: Callable[[Any, Any], Any]
) -> Callable[..., Any]:
    """Return a function that calls a hook for each part of a tuple and joins the results.

    `join(first, second)` joins two results. `empty_result` is the result of an empty tuple.
    """

    def generic(parts: Any, *arguments: Any) -> Any:
        result = empty_result
        for number, part in enumerate(parts):
            value = hook_function(part, *arguments)
            result = value if number == 0 else join(result, value)
        return result

    def choose(parts: Any, *arguments: Any) -> Any:
        if len(parts) == 0:
            return lambda parts, *arguments: empty_result
        if len(parts) == 1:
            return lambda parts, *arguments: hook_function(parts[0], *arguments)
        # Parts have different types, so compiled code calls itself for the rest, without a loop.
        return lambda parts, *arguments: join(
            hook_function(parts[0], *arguments), generic(parts[1:], *arguments)
        )

    return register(generic, choose)


@compiled
def _join_none(first: None, second: None) -> None:
    return None


def for_each_part(hook_function: Callable[..., None]) -> Callable[..., None]:
    """Return a function that calls a hook without result for each part of a tuple."""
    return for_each(hook_function, None, _join_none)


def select_by_type(
    match_function: Callable[..., Any],
    default_function: Callable[..., Any],
    is_match: Callable[[Any], bool] = lambda holder: True,
) -> Callable[..., Any]:
    """Return a function that calls one of two functions, by the types of the parts in a tuple.

    The returned function calls `match_function` if `is_match` is true for the class of any part,
    and `default_function` otherwise.
    """

    def generic(parts: Any, *arguments: Any) -> Any:
        has_match = any(is_match(type(part).part) for part in parts)
        return (match_function if has_match else default_function)(parts, *arguments)

    def choose(parts: Any, *arguments: Any) -> Any:
        has_match = any(is_match(part_class(part)) for part in parts)
        selected = match_function if has_match else default_function
        return lambda parts, *arguments: selected(parts, *arguments)

    return register(generic, choose)


def hook_functions(holder: type) -> tuple[Callable[..., Any], ...]:
    """Return the static methods of a class and its bases: the hooks of a part."""
    # A dict has each name once, in a defined order.
    names = {
        name: None
        for cls in holder.__mro__
        for name, value in vars(cls).items()
        if isinstance(value, staticmethod)
    }
    return tuple(getattr(holder, name) for name in names)


RECORD_TYPES: Final = ("float32", "int32")
"""Data types of the records of parts."""
RUN_ARRAY_TYPES: Final = ("float64", "float32", "int32")
"""Data types of the arrays of a run, which the file of a run can store."""


class Array(NamedTuple):
    """Declaration of an array of a part or of the step, from which backends derive its layout.

    Attributes
    ----------
    owner : str
        Owner of the entries, which determines the dimensions: "agent" for `[*rows, lane]`, "lane"
        for `[lane, *rows]`, "world" for `[world, *rows]`, "batch" and "run" for `[*rows]`.
    rows : tuple of int or str
        Sizes of the dimensions: numbers, or names such as "weights".
    dtype : str
        Type of the entries.
    fill : float or None
        Initial value, set once for all generations. None if the entries are undefined.
    unit : str
        Unit of a record, "1" for a number without unit.
    help : str
        Meaning of a record, a noun phrase.
    is_scratch : bool
        True if a step writes every entry that it reads, and nothing else reads the array.
        Backends leave different values in scratch: a SIMD block also computes entries that a single
        lane skips, and threads divide lists differently.
    """

    owner: str
    rows: tuple[int | str, ...] = ()
    dtype: str = "float32"
    fill: float | None = None
    unit: str = "1"
    help: str = ""
    is_scratch: bool = False


def scratch(array: Array) -> Array:
    """Declare that an array is scratch, which no comparison of backends includes."""
    return array._replace(is_scratch=True)


def per_agent(
    *rows: int | str,
    dtype: str = "float32",
    fill: float | None = None,
    unit: str = "1",
    help: str = "",
) -> Array:
    """Declare an array [row, lane] with a column for each agent.

    Parameters
    ----------
    *rows : int or str
        Sizes of the other dimensions: numbers, or "weights", "units", "inputs", "actions".
        One row by default. The first argument can be the type instead: `per_agent("int32")`.
    dtype : str
        Type of the entries. SIMD blocks need "float32".
    fill : float or None
        Initial value, set once. None if the entries are undefined, so that a lifetime must write
        an entry before it reads the entry.
    unit : str
        Unit of a record.
    help : str
        Meaning of a record, a noun phrase.
    """
    if rows and rows[0] in RECORD_TYPES:
        dtype = str(rows[0])
        rows = rows[1:]
    return Array("agent", rows or (1,), dtype, fill, unit, help)


def per_lane(*rows: int | str) -> Array:
    """Declare a float32 array [lane, row], in which the rows of an agent are contiguous in memory.

    It is faster than `per_agent` for lookups by agent.
    """
    return Array("lane", rows)


def per_world(*rows: int | str, dtype: str = "float32", fill: float | None = None) -> Array:
    """Declare an array `[world, *rows]`. The parameters are those of `per_agent`."""
    return Array("world", rows or (1,), dtype, fill)


def per_run(*rows: int | str, dtype: str = "float64", fill: float = 0.0) -> Array:
    """Declare an array `[*rows]` of a run, which hooks of evolution read and write.

    Its content is stored in checkpoints and records.

    Parameters
    ----------
    *rows : int or str
        Sizes: numbers, or names of integer settings of the part. One number by default.
    dtype : str
        Type of the entries: "float64", "float32" or "int32".
    fill : float
        Value at the beginning of a run.

    Raises
    ------
    ValueError
        If records cannot store the type.
    """
    if dtype not in RUN_ARRAY_TYPES:
        raise ValueError(f"per_run: dtype = {dtype!r} must be one of {', '.join(RUN_ARRAY_TYPES)}")
    return Array("run", rows or (1,), dtype, fill)
