"""The classes of experiments: each with the tables of the parts that it chooses, made once for each choice of parts."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from functools import cache
from typing import Any, get_args

from pydantic import BaseModel, Field, create_model

from baldwinlab.experiment import registry
from baldwinlab.experiment.fields import Fields, plain
from baldwinlab.experiment.registry import Choice, key_of

Chosen = tuple[tuple[str, type[Fields] | None], ...]
"""Dotted path of a part's table, and the part's class; None for one that is not here, whose table is read as it stands."""


@cache
def kind_of(section: type[BaseModel], field: str) -> str | None:
    """The kind of part that a field chooses, if it does."""
    info = section.model_fields[field]
    inside = [
        part
        for argument in get_args(info.annotation)
        for part in getattr(argument, "__metadata__", ())
    ]
    return next((mark.kind for mark in [*info.metadata, *inside] if isinstance(mark, Choice)), None)


@cache
def choosing_fields(section: type[BaseModel], path: str = "") -> tuple[tuple[str, str, Any], ...]:
    """Path, kind and default of every field that chooses parts."""
    found: list[tuple[str, str, Any]] = []
    for name, info in section.model_fields.items():
        if kind := kind_of(section, name):
            found.append((f"{path}{name}", kind, info.default))
        elif isinstance(info.annotation, type) and issubclass(info.annotation, BaseModel):
            found += choosing_fields(info.annotation, f"{path}{name}.")
    return tuple(found)


def chosen_parts(
    base: type[BaseModel], tree: dict[str, Any], lenient: bool = False, foreign: bool = True
) -> Chosen:
    """The parts with fields of their own that a tree of values chooses; without `foreign` ones, as if none were here."""
    found: list[tuple[str, type[Fields] | None]] = []
    for path, kind, default in choosing_fields(base):
        *steps, last = path.split(".")
        table: Any = tree
        for step in steps:
            table = plain(table.get(step, {})) if isinstance(table, dict) else {}
        names = table.get(last, default) if isinstance(table, dict) else default
        for name in (
            (names,) if isinstance(names, str) else names if isinstance(names, list | tuple) else ()
        ):
            where = ".".join([*steps, key_of(str(name))])
            if lenient and name not in (
                registry.names(kind) if foreign else registry.packaged(kind)
            ):
                if isinstance(table, dict) and key_of(str(name)) in table:
                    found.append((where, None))
            elif kind != "model" and (part := registry.own_fields(kind, str(name))):
                found.append((where, part))
    return tuple(found)


@cache
def class_for(base: Any, chosen: Chosen) -> Any:
    """`base` with the tables of the chosen parts."""
    for path, part in chosen:
        base = _with_table(base, path.split("."), part)
    return base


def _with_table(section: type[BaseModel], steps: list[str], part: type[Fields] | None) -> Any:
    below: Any
    if len(steps) > 1:
        inside = _with_table(section.model_fields[steps[0]].annotation, steps[1:], part)  # type: ignore[arg-type]
        below = (inside, with_its_default(inside))
    elif part is None:
        below = (dict[str, Any], ...)
    else:
        below = (part, with_its_default(part))
    return create_model(
        section.__name__, __base__=section, __module__=section.__module__, **{steps[0]: below}
    )


def with_its_default(table: type[BaseModel]) -> Any:
    """The table as it is where nothing is given; required where it has a field without a default."""
    required = any(info.is_required() for info in table.model_fields.values())
    return (
        Field(description=_meaning(table))
        if required
        else Field(default_factory=table, description=_meaning(table))
    )


def _meaning(table: type[BaseModel]) -> str:
    return (table.__doc__ or "").strip().split("\n")[0]


def with_defaults(table: type[Fields], values: Mapping[str, Any]) -> type[Fields]:
    """The table with other defaults of its fields."""
    fields: dict[str, Any] = {}
    for name, value in values.items():
        info = copy(table.model_fields[name])
        info.default = value
        fields[name] = (info.annotation, info)
    return (
        create_model(table.__name__, __base__=table, __module__=table.__module__, **fields)
        if fields
        else table
    )
