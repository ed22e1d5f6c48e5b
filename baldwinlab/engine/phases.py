"""Phases: functions that every part of a kind has, chosen by the part's type when the step is compiled.

In compiled code a part is a NamedTuple whose class has the attribute `part`: the class that holds its hooks as static methods.
A hook is called with the part first, as `learn(rule, model, state, step, lane)`; Numba compiles the part's own function in its
place, so that a step has neither branch nor indirection. In plain Python, and in the simulator of a GPU, the same call looks
the function up.
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
    """A hook, named and documented by the function, which is also what parts do that have none of their own."""

    @wraps(default)
    def generic(part: Any, *others: Any) -> Any:
        return getattr(type(part).part, default.__name__)(part, *others)

    def choose(part: Any, *others: Any) -> Any:
        return getattr(part_class(part), default.__name__)

    generic.default = default  # type: ignore[attr-defined]
    return register(generic, choose)


def for_each(
    of_one: Callable[..., Any], nothing: Any, join: Callable[[Any, Any], Any]
) -> Callable[..., Any]:
    """A hook of several parts in a tuple, one after the other: what it gives for each, joined; `nothing` if there are none."""

    def generic(parts: Any, *others: Any) -> Any:
        found = nothing
        for number, part in enumerate(parts):
            found = of_one(part, *others) if number == 0 else join(found, of_one(part, *others))
        return found

    def choose(parts: Any, *others: Any) -> Any:
        if len(parts) == 0:
            return lambda parts, *others: nothing
        if len(parts) == 1:
            return lambda parts, *others: of_one(parts[0], *others)
        return lambda parts, *others: join(of_one(parts[0], *others), generic(parts[1:], *others))

    return register(generic, choose)


@compiled
def _nothing(one: None, other: None) -> None:
    return None


def for_each_part(of_one: Callable[..., None]) -> Callable[..., None]:
    """A hook of several parts in a tuple that gives nothing."""
    return for_each(of_one, None, _nothing)


def select_by_type(
    some: Callable[..., Any],
    none: Callable[..., Any],
    that: Callable[[Any], bool] = lambda holder: True,
) -> Callable[..., Any]:
    """One function where there are parts in a tuple, or such of whose class `that` holds, and another where there are none."""

    def generic(parts: Any, *others: Any) -> Any:
        return (some if any(that(type(part).part) for part in parts) else none)(parts, *others)

    def choose(parts: Any, *others: Any) -> Any:
        taken = some if any(that(part_class(part)) for part in parts) else none
        return lambda parts, *others: taken(parts, *others)

    return register(generic, choose)


def hook_functions(holder: type) -> tuple[Callable[..., Any], ...]:
    """The static methods of a class and of those it derives from: the hooks of a part."""
    names = {
        name: None
        for each in holder.__mro__
        for name, value in vars(each).items()
        if isinstance(value, staticmethod)
    }
    return tuple(getattr(holder, name) for name in names)


class Array(NamedTuple):
    """An array of a part, or of the step itself, declared with its owner, from which every venue derives where it lies.

    owner: "agent", [*rows, lane]; "lane", [lane, *rows], an agent's too; "world", [world, *rows]; "batch", [*rows], the same for
    all worlds.
    Rows are numbers, or names of dimensions.
    fill: the content when the array is allocated, once for all generations; None: undefined, so that the owner must write a
    value before it reads one, in every lifetime.
    """

    owner: str
    rows: tuple[int | str, ...] = ()
    dtype: str = "float32"
    fill: float | None = None


def per_agent(*rows: int | str, dtype: str = "float32", fill: float | None = None) -> Array:
    """An array [row, lane] that belongs to agents: a per-agent hook reaches only the column of its own."""
    return Array("agent", rows or (1,), dtype, fill)


def per_lane(*rows: int | str, dtype: str = "float32", fill: float | None = None) -> Array:
    """An array [lane, row] that belongs to agents, for what is looked up agent by agent: an agent's rows lie side by side.

    As columns they would be a cache miss each, where there are many agents.
    """
    return Array("lane", rows or (1,), dtype, fill)


def per_world(*rows: int | str, dtype: str = "float32", fill: float | None = None) -> Array:
    """An array [world, *rows] that belongs to worlds."""
    return Array("world", rows or (1,), dtype, fill)
