"""An experiment in a notebook: a table of its fields, what differs from the defaults first. Colours are the notebook's own."""

from __future__ import annotations

import json
from collections.abc import Iterator
from html import escape
from typing import Any, NamedTuple

from pydantic import BaseModel
from pydantic_core import PydanticUndefined

from baldwinlab.experiment.fields import brief, plain

LEFT = 'style="text-align: left; vertical-align: top"'


class Row(NamedTuple):
    path: str
    value: str
    default: str  # "–" where the field has none
    meaning: str  # with its unit

    @property
    def differs(self) -> bool:
        return self.value != self.default


def rows(table: BaseModel, default: Any = None, path: str = "") -> Iterator[Row]:
    """Every field below `path`, in the order of the experiment; `default` is the table as it would be unless told otherwise."""
    for (
        name,
        value,
    ) in (
        table
    ):  # with what is there beside the fields, in an experiment of a model that is not here
        info = type(table).model_fields.get(name)
        usual = (
            default[name] if isinstance(default, dict) and name in default else _default_of(info)
        )
        if isinstance(value, BaseModel):
            yield from rows(value, plain(usual), f"{path}{name}.")
        elif isinstance(value, tuple) and value and isinstance(value[0], BaseModel):
            for number, entry in enumerate(value):
                yield from rows(entry, None, f"{path}{name}.{number}.")
        else:
            usually = "–" if usual is PydanticUndefined else _text(usual)
            yield Row(f"{path}{name}", _text(value), usually, (info and info.description) or "")


def _default_of(info: Any) -> Any:
    return PydanticUndefined if info is None else info.get_default(call_default_factory=True)


def _text(value: Any) -> str:
    """As JSON has it, but for words, which stand alone, and what is not set; cut short where it is long."""
    return (
        "not set"
        if value is None
        else brief(value if isinstance(value, str) else json.dumps(plain(value)))
    )


def html(experiment: BaseModel, name: str, model: str) -> str:
    """Return the fields of an experiment as two tables: changed fields, and all fields, folded."""
    found = [row for row in rows(experiment) if row.path not in ("name", "model")]
    changed = [row for row in found if row.differs]
    title = f"<strong>{escape(name)}</strong>, an experiment of the model {escape(model)}"
    told = (
        f"{len(changed)} of its {len(found)} fields differ from their defaults:"
        if changed
        else "all fields are at their defaults."
    )
    return (
        f"<div><p>{title}; {told}</p>{_table(changed) if changed else ''}"
        f"<details><summary>all fields</summary>{_table(found)}</details></div>"
    )


def _table(shown: list[Row]) -> str:
    head = "".join(f"<th {LEFT}>{name}</th>" for name in ("field", "value", "default", "meaning"))
    body = "".join(
        f"<tr>{''.join(f'<td {LEFT}>{cell}</td>' for cell in _cells(row))}</tr>" for row in shown
    )
    return f'<div style="overflow-x: auto"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'


def _cells(row: Row) -> tuple[str, ...]:
    path, value, default, meaning = map(escape, row)
    return (
        f"<code>{path}</code>",
        f"<strong>{value}</strong>" if row.differs else value,
        default,
        meaning,
    )
