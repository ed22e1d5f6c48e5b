"""Records of parts: numbers of agents that a part writes during life, and that are stored."""

from __future__ import annotations

import ast
from collections.abc import Callable
from typing import Any, Final

from baldwinlab.engine.jit import compiled, register
from baldwinlab.engine.phases import RECORD_TYPES, Array, for_each_part, part_class
from baldwinlab.parts.lane_check import find_definition

READING_HOOKS: Final = ("evaluate", "select", "should_stop")
"""Hooks that read results of lifetimes."""


def add_record_arrays(part: Any) -> None:
    """Declare an array for each record of a part, after its other arrays."""
    for name, array in part.records.items():
        is_number = isinstance(array, Array) and (array.owner, array.rows) == ("agent", (1,))
        if not is_number or array.dtype not in RECORD_TYPES:
            raise TypeError(
                f"{part.__name__}.records: {name!r} must be one number of an agent: "
                'per_agent("float32") or per_agent("int32")'
            )
        if part.arrays.get(name, array) is not array:
            raise TypeError(f"{part.__name__}.records: {name!r} is also the name of an array")
    arrays = {name: array for name, array in part.arrays.items() if name not in part.records}
    part.arrays = arrays | dict(part.records)


def list_read_records(part: Any) -> tuple[str, ...]:
    """Return the names of the records that the hooks of a part read."""
    hooks = [getattr(part, name) for name in READING_HOOKS if hasattr(part, name)]
    names: dict[str, None] = {}
    for definition in map(find_definition, hooks):
        for node in ast.walk(definition) if definition is not None else ():
            if isinstance(node, ast.Attribute) and _is_records(node.value):
                names[node.attr] = None
    return tuple(names)


def _is_records(node: ast.expr) -> bool:
    return isinstance(node, ast.Attribute) and node.attr == "records"


@compiled
def _clear_array(array: Any, lane: int) -> None:
    array[0, lane] = 0


_clear_arrays = for_each_part(_clear_array)


def clear_part_records(part: Any, lane: int) -> None:
    """Set the records of an agent to 0. Compiled code calls it at birth."""
    for name in _record_names(type(part).part):
        getattr(part, name)[0, lane] = 0


def _record_names(part: Any) -> tuple[str, ...]:
    return tuple(getattr(part, "records", ()))


def _choose_clear(part: Any, lane: Any) -> Callable[..., None]:
    """Return the source of `clear_part_records` for the type of a part."""
    holder = part_class(part)
    names = _record_names(holder)
    if not names:
        return lambda part, lane: None
    first = holder.Compiled._fields.index(names[0])
    end = first + len(names)
    return lambda part, lane: _clear_arrays(part[first:end], lane)


register(clear_part_records, _choose_clear)
