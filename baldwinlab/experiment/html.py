"""Experiments as HTML tables for notebooks, in the colors of the notebook."""

from __future__ import annotations

import json
from collections.abc import Iterator
from html import escape
from typing import Any, NamedTuple

from pydantic import BaseModel
from pydantic_core import PydanticUndefined

from baldwinlab.experiment.fields import shorten, to_plain_data

LEFT_STYLE = 'style="text-align: left; vertical-align: top"'


class Row(NamedTuple):
    """A setting, as a row of a table."""

    path: str
    value: str
    # "–" without a default.
    default: str
    meaning: str

    @property
    def differs(self) -> bool:
        return self.value != self.default


def iterate_rows(table: BaseModel, default: Any = None, path: str = "") -> Iterator[Row]:
    """Yield a row per setting below `path`. `default` is the table with default values."""
    # A table of a model that is not loaded has values without fields.
    for name, value in table:
        field = type(table).model_fields.get(name)
        has_given_default = isinstance(default, dict) and name in default
        default_value = default[name] if has_given_default else _find_default(field)
        if isinstance(value, BaseModel):
            yield from iterate_rows(value, to_plain_data(default_value), f"{path}{name}.")
        elif isinstance(value, tuple) and value and isinstance(value[0], BaseModel):
            for index, entry in enumerate(value):
                yield from iterate_rows(entry, None, f"{path}{name}.{index}.")
        else:
            has_default = default_value is not PydanticUndefined
            yield Row(
                path=f"{path}{name}",
                value=_format_value(value),
                default=_format_value(default_value) if has_default else "–",
                meaning=(field.description or "") if field else "",
            )


def _find_default(field: Any) -> Any:
    return PydanticUndefined if field is None else field.get_default(call_default_factory=True)


def _format_value(value: Any) -> str:
    """Return a value as JSON, but texts without quotes, and cut if it is long."""
    if value is None:
        return "not set"
    return shorten(value if isinstance(value, str) else json.dumps(to_plain_data(value)))


def format_html(experiment: BaseModel, name: str, model: str) -> str:
    """Return the fields of an experiment as two tables: changed fields, and all fields, folded."""
    settings = [row for row in iterate_rows(experiment) if row.path not in ("name", "model")]
    changed = [row for row in settings if row.differs]
    title = f"<strong>{escape(name)}</strong>, an experiment of the model {escape(model)}"
    summary = (
        f"{len(changed)} of its {len(settings)} fields differ from their defaults:"
        if changed
        else "all fields are at their defaults."
    )
    return (
        f"<div><p>{title}; {summary}</p>{_format_table(changed) if changed else ''}"
        f"<details><summary>all fields</summary>{_format_table(settings)}</details></div>"
    )


def _format_table(rows: list[Row]) -> str:
    head = "".join(
        f"<th {LEFT_STYLE}>{name}</th>" for name in ("field", "value", "default", "meaning")
    )
    body = ""
    for row in rows:
        cells = "".join(f"<td {LEFT_STYLE}>{cell}</td>" for cell in _format_cells(row))
        body += f"<tr>{cells}</tr>"
    table = f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
    return f'<div style="overflow-x: auto">{table}</div>'


def _format_cells(row: Row) -> tuple[str, ...]:
    path, value, default, meaning = map(escape, row)
    return (
        f"<code>{path}</code>",
        f"<strong>{value}</strong>" if row.differs else value,
        default,
        meaning,
    )
