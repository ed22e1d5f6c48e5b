"""Classes of experiments: the class of a model with one table for each chosen part with settings.

A section is a table that contains settings, such as `evolution`. Each model and each combination of
parts has one class.
"""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from functools import cache, lru_cache
from typing import Any, get_args

from pydantic import BaseModel, Field, create_model

from baldwinlab.experiment import registry
from baldwinlab.experiment.fields import ExperimentError, Fields, to_plain_data
from baldwinlab.experiment.registry import PartChoice, table_name
from baldwinlab.experiment.schedule import SCHEDULE_FIELD, Change
from baldwinlab.experiment.tables import Evolution, ModelName, Name, Population, Record

ChosenParts = tuple[tuple[str, type[Fields] | None], ...]
"""Path of each part's table, such as "evolution.larger_tournament", and class; None: not loaded."""


@cache
def find_part_kind(section: type[BaseModel], field: str) -> str | None:
    """Return the kind of part that a setting chooses, such as "selection", or None."""
    info = section.model_fields[field]
    # The mark is on the type of the setting, or for a tuple of parts on the type of its entries.
    marks_of_entries = [
        mark
        for argument in get_args(info.annotation)
        for mark in getattr(argument, "__metadata__", ())
    ]
    marks = [*info.metadata, *marks_of_entries]
    return next((mark.kind for mark in marks if isinstance(mark, PartChoice)), None)


@cache
def choosing_fields(section: type[BaseModel], path: str = "") -> tuple[tuple[str, str, Any], ...]:
    """Return path, kind and default of every setting that chooses parts of a class of tables."""
    settings: list[tuple[str, str, Any]] = []
    for name, info in section.model_fields.items():
        if kind := find_part_kind(section, name):
            settings.append((f"{path}{name}", kind, info.default))
        elif isinstance(info.annotation, type) and issubclass(info.annotation, BaseModel):
            settings += choosing_fields(info.annotation, f"{path}{name}.")
    return tuple(settings)


def chosen_parts(
    base: type[BaseModel],
    tree: dict[str, Any],
    lenient: bool = False,
    with_custom_parts: bool = True,
) -> ChosenParts:
    """Return the parts with settings that a tree of values chooses, with or without custom parts.

    `lenient`: a part that is not loaded has the class None. Otherwise it is left out.
    """
    parts: list[tuple[str, type[Fields] | None]] = []
    for path, kind, default in choosing_fields(base):
        *steps, field = path.split(".")
        table: Any = tree
        for step in steps:
            table = to_plain_data(table.get(step, {})) if isinstance(table, dict) else {}
        value = table.get(field, default) if isinstance(table, dict) else default
        available = registry.names(kind) if with_custom_parts else registry.package_parts(kind)
        for name in _to_names(value):
            table_path = ".".join([*steps, table_name(str(name))])
            if lenient and name not in available:
                if isinstance(table, dict) and table_name(str(name)) in table:
                    parts.append((table_path, None))
            elif kind != "model" and (part := registry.settings_class(kind, str(name))):
                parts.append((table_path, part))
    return tuple(parts)


def _to_names(value: Any) -> tuple[Any, ...]:
    """Return the names that a setting of one or several parts contains; () for other types."""
    if isinstance(value, str):
        return (value,)
    return tuple(value) if isinstance(value, list | tuple) else ()


def remove_idle_tables(
    tree: dict[str, Any],
    chosen: ChosenParts,
    chosen_before: ChosenParts,
    changes: dict[str, Any],
) -> dict[str, Any]:
    """Remove the tables of parts that are no longer chosen from a tree, and return the tree.

    A table in `changes` stays, so that validation reports this mistake of a user.
    """
    chosen_paths = {path for path, _ in chosen}
    for path, _ in chosen_before:
        *steps, part_table = path.split(".")
        section = tree
        changed_section = changes
        for step in steps:
            section = section[step]
            is_table = isinstance(changed_section, dict)
            changed_section = changed_section.get(step, {}) if is_table else {}
        is_idle = path not in chosen_paths and part_table not in changed_section
        if is_idle and isinstance(section, dict):
            section.pop(part_table, None)
    return tree


def make_part(section: BaseModel, field: str, name: str, path: str) -> Any:
    """Return the part `name` that the setting `field` of a table chooses, with its settings.

    `path`: path of the setting, for the ExperimentError about a part that is not loaded.
    """
    kind = find_part_kind(type(section), field)
    assert kind is not None, path
    # For a part with the name "copy", `getattr` would return the method `copy` of the table.
    table = vars(section).get(table_name(name))
    if isinstance(table, Fields):
        return table
    if table is not None or not registry.is_available(kind, name):
        raise ExperimentError(
            f"{path} = {name!r} is a {kind} that is not loaded: {registry.PART_HINT}"
        )
    return _make_plain_part(registry.find_class(kind, name))


@lru_cache(maxsize=256)
def _make_plain_part(part: type) -> Any:
    """Return a part without settings, from a cache: simulations read parts in every generation."""
    return part()


@cache
def make_model_class(base: Any, model: type[Fields], name: str) -> Any:
    """Return the class `base` with the table of a model, and with the model's other defaults."""
    tables: dict[str, Any] = {"population": Population, "evolution": Evolution, "record": Record}
    defaults = getattr(model, "defaults", {})
    tables_of_model = {
        key: _replace_defaults(table, defaults.get(key, {})) for key, table in tables.items()
    }
    fields: dict[str, Any] = {
        "name": (Name, name),
        "model": (ModelName, Field(name, description="Model of founders, lifetimes and payoffs.")),
        table_name(name): (model, _make_table_field(model)),
        **{key: (table, _make_table_field(table)) for key, table in tables_of_model.items()},
        "schedule": (tuple[Change, ...], SCHEDULE_FIELD),
    }
    return create_model("Experiment", __base__=base, __module__=base.__module__, **fields)


@cache
def make_class(base: Any, chosen: ChosenParts) -> Any:
    """Return the class `base` with the tables of the chosen parts."""
    for path, part in chosen:
        base = _with_table(base, path.split("."), part)
    return base


def _with_table(section: type[BaseModel], steps: list[str], part: type[Fields] | None) -> Any:
    field_name, *further_steps = steps
    # (type, default) of the field. The default `...` means that the field is required.
    declaration: Any
    if further_steps:
        inner_section: Any = section.model_fields[field_name].annotation
        inner_class = _with_table(inner_section, further_steps, part)
        declaration = (inner_class, _make_table_field(inner_class))
    elif part is None:
        declaration = (dict[str, Any], ...)
    else:
        declaration = (part, _make_table_field(part))
    return create_model(
        section.__name__,
        __base__=section,
        __module__=section.__module__,
        **{field_name: declaration},
    )


def _make_table_field(table: type[BaseModel]) -> Any:
    """Return the field of a table. It is required if a setting of the table has no default."""
    description = (table.__doc__ or "").strip().split("\n")[0]
    is_required = any(info.is_required() for info in table.model_fields.values())
    if is_required:
        return Field(description=description)
    return Field(default_factory=table, description=description)


def _replace_defaults(table: type[Fields], values: Mapping[str, Any]) -> type[Fields]:
    fields: dict[str, Any] = {}
    for name, value in values.items():
        info = copy(table.model_fields[name])
        info.default = value
        fields[name] = (info.annotation, info)
    if not fields:
        return table
    return create_model(table.__name__, __base__=table, __module__=table.__module__, **fields)
