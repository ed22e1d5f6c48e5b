"""Declarations of the fields of `MiniWorldModel` and `State`.

A declaration is `name: Annotated[type, source, "Description."]`. The source of the value is an
`Array`, a `Setting` or a `ChosenPart`. `allocation.py` computes a field without a source.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple, TypeVar, get_type_hints

from baldwinlab.engine.phases import Array
from baldwinlab.experiment.paths import look_up

Source = TypeVar("Source")
TupleClass = TypeVar("TupleClass", bound=type)


class Setting(NamedTuple):
    """Source of a number: the value of a setting, or whether the setting has the value `equals`."""

    path: str
    equals: str | None = None


class ChosenPart(NamedTuple):
    """Source of a part that a setting chooses, or of a tuple of parts (`are_several`)."""

    path: str
    are_several: bool = False


def _iterate_fields(tuple_class: type) -> Iterator[tuple[str, Any, Any, str]]:
    """Yield the name, type, source and description of each field. The source can be None."""
    for name, hint in get_type_hints(tuple_class, include_extras=True).items():
        *sources, description = hint.__metadata__
        yield name, hint.__origin__, sources[0] if sources else None, description


def find_sources(tuple_class: type, kind: type[Source]) -> dict[str, Source]:
    """Return the sources of a class, for example all `Array`s, by the name of the field."""
    fields = _iterate_fields(tuple_class)
    return {name: source for name, _, source, _ in fields if isinstance(source, kind)}


def read_settings(tuple_class: type, experiment: Any) -> dict[str, Any]:
    """Return the values of the fields of a tuple with a `Setting`, by name, as numbers."""
    numbers = {}
    for name, number_type, source, _ in _iterate_fields(tuple_class):
        if isinstance(source, Setting):
            value, _ = look_up(experiment, source.path)
            has_value = source.equals is None
            numbers[name] = number_type(value if has_value else value == source.equals)
    return numbers


def describe_fields(tuple_class: TupleClass) -> TupleClass:
    """Add the descriptions of the fields to the docstring of a tuple."""
    lines = [str(tuple_class.__doc__), "", "Attributes", "----------"]
    for name, field_type, source, description in _iterate_fields(tuple_class):
        heading = name
        if isinstance(source, Array):
            heading += f" : {source.dtype} [{_format_shape(source)}]"
        elif field_type is not Any:
            heading += f" : {field_type.__name__}"
        lines += [heading, f"    {description}"]
    tuple_class.__doc__ = "\n".join(lines)
    return tuple_class


def _format_shape(array: Array) -> str:
    """Return the dimensions of an array, such as "weights, lane"."""
    rows = ", ".join(map(str, array.rows))
    return {"agent": f"{rows}, lane", "world": f"world, {rows}"}.get(array.owner, rows)
