"""Dotted paths into an experiment: `lifetime.steps`, `world.food.0.count`."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from copy import deepcopy
from typing import Any

from pydantic import BaseModel

from baldwinlab.core.files import parse_toml
from baldwinlab.experiment.fields import (
    ExperimentError,
    describe_missing_name,
    to_plain_data,
)


def look_up(experiment: BaseModel, path: str) -> tuple[Any, str]:
    """Return the value and the description of a setting. Raise ExperimentError if it is missing."""
    value: Any = experiment
    meaning = ""
    for step in path.split("."):
        if isinstance(value, BaseModel) and step in type(value).model_fields:
            meaning = type(value).model_fields[step].description or ""
            value = getattr(value, step)
        elif isinstance(value, dict) and step in value:
            # The table of a part that is not loaded is a dict.
            value = value[step]
            meaning = ""
        elif isinstance(value, tuple) and step.isdecimal() and int(step) < len(value):
            value = value[int(step)]
        else:
            raise ExperimentError(_describe_missing_step(to_plain_data(value), step, path))
    return value, meaning


def short_name(path: str, *experiments: BaseModel) -> str:
    """Return a short name of a setting for an axis, such as "learning rate, per step".

    The name of a number is the first clause of its description, without "(R1)" to "(R8)".
    The name of a text is its path: "evolution: selection". A setting of one of several regions has
    the number of the region: "energy of an item, food 2". The first experiment with the setting
    gives the name. If no experiment has the setting, the name is the path.
    """
    for experiment in experiments:
        with suppress(ExperimentError):
            value, meaning = look_up(experiment, path)
            if isinstance(value, str):
                return path.replace(".", ": ").replace("_", " ")
            if meaning:
                return _first_clause(meaning) + _region_suffix(path, experiment)
    return path


def _first_clause(description: str) -> str:
    clause = re.split(r"[;:]|[.](?=\s|$)", description)[0]
    clause = re.sub(r" \(R\d+\)$", "", clause)
    # A first word such as "A" or "SHA" is a symbol, which keeps its capital letters.
    is_word = clause[1:2].islower()
    return clause[0].lower() + clause[1:] if is_word else clause


def _region_suffix(path: str, experiment: BaseModel) -> str:
    """Return the number of a region, for example ", food 2", or "" for a single region."""
    steps = path.split(".")
    for depth, step in enumerate(steps):
        if step.isdecimal():
            # The steps before a number are the path of a tuple of regions, such as "world.food".
            regions, _ = look_up(experiment, ".".join(steps[:depth]))
            if len(regions) > 1:
                region_number = int(step) + 1
                return f", {steps[depth - 1]} {region_number}"
    return ""


def iterate_settings(tables: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the dotted path and the value of each setting in nested tables."""
    for name, value in tables.items():
        if isinstance(value, Mapping):
            yield from iterate_settings(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value


def nest_settings(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return nested tables: {"lifetime": {"steps": 5}} for {"lifetime.steps": 5}."""
    tree: dict[str, Any] = {}
    for path, value in settings.items():
        *tables, field = path.split(".")
        table = tree
        for name in tables:
            table = table.setdefault(name, {})
        table[field] = value
    return tree


def combine_settings(changes: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the settings after several changes. A change and the result have settings by path.

    A new value of a list, such as `world.food`, drops earlier changes of the entries. A later
    change of an entry, such as `world.food.0.count`, changes the list.
    """
    combined: dict[str, Any] = {}
    for path, value in (setting for change in changes for setting in change.items()):
        if isinstance(value, list):
            prefix = f"{path}."
            combined = {key: entry for key, entry in combined.items() if not key.startswith(prefix)}
        lists = (key for key, entry in combined.items() if isinstance(entry, list))
        changed_list = next((key for key in lists if path.startswith(f"{key}.")), "")
        if changed_list:
            # The remaining path, such as ".0.count", begins with an empty step: the key "".
            tree = {"": deepcopy(combined[changed_list])}
            set_value(tree, path.removeprefix(changed_list), value)
            combined[changed_list] = tree[""]
        else:
            combined[path] = value
    return combined


def set_value(tree: dict[str, Any], path: str, value: Any) -> None:
    """Set the value at a path of a tree of dicts and lists."""
    table: Any = tree
    *steps, field = path.strip().split(".")
    for step in steps:
        table = table[_require_key(table, step, path)]
    table[_require_key(table, field, path)] = value


def _require_key(table: Any, step: str, path: str) -> str | int:
    if isinstance(table, list) and step.isdecimal() and int(step) < len(table):
        return int(step)
    if isinstance(table, dict) and step in table:
        return step
    raise ExperimentError(_describe_missing_step(table, step, path))


def _describe_missing_step(table: Any, step: str, path: str) -> str:
    names: Any = ()
    if isinstance(table, dict):
        names = list(table)
    elif isinstance(table, list):
        names = range(len(table))
    return describe_missing_name(path, step, names)


def parse_assignment(assignment: str) -> tuple[str, Any]:
    """Return path and value of an assignment: ("lifetime.steps", 1000) for "lifetime.steps=1000".

    A value that is not TOML is a text.
    """
    path, equals, text = assignment.partition("=")
    if not equals:
        raise ExperimentError(f"{assignment}: must be path=value, such as lifetime.steps=1000")
    try:
        return path.strip(), parse_toml(f"value = {text.strip()}")["value"]
    except tomllib.TOMLDecodeError:
        return path.strip(), text.strip()
