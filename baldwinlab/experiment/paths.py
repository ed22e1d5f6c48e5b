"""Dotted paths into an experiment: `lifetime.steps`, `world.food.0.count`."""

from __future__ import annotations

import tomllib
from typing import Any

from pydantic import BaseModel

from baldwinlab.experiment.fields import ExperimentError, plain


def look_up(experiment: BaseModel, path: str) -> tuple[Any, str]:
    """The value at a path, and what it means. Raises ExperimentError for a path that there is not."""
    value: Any = experiment
    meaning = ""
    for step in path.split("."):
        if isinstance(value, BaseModel) and step in type(value).model_fields:
            meaning = type(value).model_fields[step].description or ""
            value = getattr(value, step)
        elif isinstance(value, dict) and step in value:  # the table of a part that is not here
            value, meaning = value[step], ""
        elif isinstance(value, tuple) and step.isdecimal() and int(step) < len(value):
            value = value[int(step)]
        else:
            raise ExperimentError(_absent(plain(value), step, path))
    return value, meaning


def put(tree: dict[str, Any], path: str, value: Any) -> None:
    """Set what is at a path of a tree of dicts and lists. Raises ExperimentError for a path that there is not."""
    table: Any = tree
    *steps, last = path.strip().split(".")
    for step in steps:
        table = table[_key(table, step, path)]
    table[_key(table, last, path)] = value


def _key(table: Any, step: str, path: str) -> str | int:
    if isinstance(table, list) and step.isdecimal() and int(step) < len(table):
        return int(step)
    if isinstance(table, dict) and step in table:
        return step
    raise ExperimentError(_absent(table, step, path))


def _absent(table: Any, step: str, path: str) -> str:
    names = list(table) if isinstance(table, dict) else range(len(table)) if isinstance(table, list) else ()
    return f"{path}: there is no {step!r} here; there are: {', '.join(map(str, names)) or 'none'}"


def parse(assignment: str) -> tuple[str, Any]:
    """`path=value`, where the value is TOML; what is not TOML is a plain string. Raises ExperimentError."""
    path, equals, text = assignment.partition("=")
    if not equals:
        raise ExperimentError(f"{assignment}: must be path=value, such as lifetime.steps=1000")
    try:
        return path.strip(), tomllib.loads(f"value = {text.strip()}")["value"]
    except tomllib.TOMLDecodeError:
        return path.strip(), text.strip()
