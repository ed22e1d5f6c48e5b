"""Experiments as TOML text."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import tomlkit
from pydantic import BaseModel
from tomlkit.exceptions import ConvertError

from baldwinlab.core.files import parse_toml
from baldwinlab.experiment import BaseExperiment, Experiment, ExperimentError, validate
from baldwinlab.experiment.fields import to_plain_data
from baldwinlab.experiment.paths import iterate_settings


def to_toml(experiment: BaseExperiment) -> str:
    """Return an experiment as TOML, with the description of every setting."""
    document = tomlkit.document()
    _fill(document, experiment)
    return tomlkit.dumps(document)


def _fill(table: Any, part: BaseModel) -> None:
    tables = []
    meanings = {name: field.description for name, field in type(part).model_fields.items()}
    # The experiment of a model that is not loaded has values without fields.
    for name, value in part:
        are_tables = isinstance(value, tuple) and value and isinstance(value[0], BaseModel)
        if are_tables or isinstance(value, BaseModel | dict):
            # In TOML, tables follow plain values.
            tables.append((name, value))
            continue
        meaning = meanings.get(name)
        # TOML has no null value, so a comment replaces the setting.
        if value is None:
            table.add(tomlkit.comment(f"{name} is not set: {meaning}"))
            continue
        item = tomlkit.item(list(value) if isinstance(value, tuple) else value)
        table.add(name, item.comment(meaning) if meaning else item)
    for name, value in tables:
        if isinstance(value, BaseModel):
            table.add(name, _make_table(value))
        elif isinstance(value, dict):
            # The table of a part that is not loaded is a dict.
            table.add(name, tomlkit.item(value))
        else:
            array_of_tables = tomlkit.aot()
            for entry in value:
                array_of_tables.append(_make_table(entry))
            table.add(name, array_of_tables)


def _make_table(part: BaseModel) -> Any:
    table = tomlkit.table()
    _fill(table, part)
    return table


def from_toml(text: str, source: str, lenient: bool = False) -> Experiment:
    """Return the experiment of a TOML text. Raise ExperimentError, which names `source`."""
    tree = parse_tree(text, source)
    with name_source_in_errors(source):
        made: Experiment = validate(tree, lenient)
    return made


def parse_tree(text: str, source: str) -> dict[str, Any]:
    """Return the tables of a TOML text. Raises ExperimentError with the name `source`."""
    try:
        return parse_toml(text)
    except tomllib.TOMLDecodeError as error:
        raise ExperimentError(f"{source} is not TOML: {error}") from None


@contextmanager
def name_source_in_errors(source: str) -> Iterator[None]:
    """Name a file in each line of an ExperimentError."""
    try:
        yield
    except ExperimentError as error:
        lines = (f"{source}: {line}" for line in str(error).splitlines())
        raise ExperimentError("\n".join(lines)) from None


def format_assignments(tables: Mapping[str, Any]) -> list[str]:
    """Return settings as assignments such as "lifetime.steps=5".

    `tables`: nested tables or paths: {"lifetime": {"steps": 5}} or {"lifetime.steps": 5}.
    """
    assignments = []
    for path, value in iterate_settings(to_plain_data(tables)):
        try:
            assignments.append(f"{path}={format_inline(value)}")
        except ConvertError:
            raise ExperimentError(
                f"{path} = {value!r}: a value must be a number, true or false, a text, or a list "
                "or a table of these"
            ) from None
    return assignments


def format_inline(value: Any) -> str:
    """Return a value as TOML on one line. A table in a list is written as `{count = 3}`."""
    if isinstance(value, Mapping):
        entries = (f"{key} = {format_inline(entry)}" for key, entry in value.items())
        return f"{{{', '.join(entries)}}}"
    if isinstance(value, list):
        return f"[{', '.join(format_inline(entry) for entry in value)}]"
    text: str = tomlkit.item(value).as_string()
    return text
