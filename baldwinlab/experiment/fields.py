"""Base class of the tables of an experiment, messages about invalid settings, and HTML.

A notebook shows an experiment as HTML tables of its settings, in the colors of the notebook.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from html import escape
from pathlib import PurePath
from typing import Any, Final, NamedTuple, Self

from pydantic import BaseModel, ConfigDict, ValidationError, field_validator
from pydantic_core import PydanticCustomError, PydanticUndefined

from baldwinlab.core.errors import BaldwinLabError
from baldwinlab.core.names import describe_pattern

MAX_FAULTS: Final = 10
"""Number of errors that a message lists."""
MAX_TEXT_LENGTH: Final = 100
"""Number of characters of a path or a value in a message."""
FIELDS_REFUSED: Final = "fields_refused"
"""Type of the errors of pydantic that `refuse_fields` raises."""
LEFT_STYLE: Final = 'style="text-align: left; vertical-align: top"'


class ExperimentError(BaldwinLabError, ValueError):
    """Invalid experiment. Each line names a setting, its value and the allowed values."""


class Fields(BaseModel):
    """Base class of the tables of an experiment.

    Unknown settings are errors, and so is true or false for a number.
    """

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        allow_inf_nan=False,
        strict=False,
        validate_default=True,
        protected_namespaces=(),
    )

    def __iter__(self) -> Generator[tuple[str, Any], None, None]:
        """Yield the name and value of each setting.

        Pydantic also yields the values of cached properties, which are no settings.
        """
        for name in (*type(self).model_fields, *(self.model_extra or ())):
            yield name, getattr(self, name)

    @field_validator("*", mode="before")
    @classmethod
    def _normalize_numbers(cls, value: Any, info: Any) -> Any:
        """Refuse true and false for a number, which Python would read as 1. Convert NumPy."""
        value = to_plain_data(value) if hasattr(value, "tolist") else value
        accepts_truth = cls.model_fields[info.field_name].annotation in (bool, Any)
        if isinstance(value, bool) and not accepts_truth:
            raise ValueError("true and false are not numbers")
        return value


class HashedFields(Fields):
    """Table that computes its hash once.

    Simulations look up caches by experiment several times in each generation.
    """

    def __hash__(self) -> int:
        # Pydantic leaves out names with an underscore.
        values = vars(self)
        if "_hash" not in values:
            hashes = [_hash_value(values[name]) for name in type(self).model_fields]
            values["_hash"] = hash((type(self), *hashes))
        return int(values["_hash"])

    def __copy__(self) -> Self:
        """Return a copy without the hash, because `model_copy` changes the copy."""
        # `__new__` of an experiment would choose the class of an experiment with default parts.
        copied: Self = object.__new__(type(self))
        state = self.__getstate__()
        values = {name: value for name, value in vars(self).items() if name != "_hash"}
        set_fields = set(self.model_fields_set)
        copied.__setstate__(state | {"__dict__": values, "__pydantic_fields_set__": set_fields})
        return copied

    def __deepcopy__(self, memo: dict[int, Any] | None = None) -> Self:
        """Return the table itself, because it is immutable."""
        return self


def _hash_value(value: Any) -> int:
    try:
        return hash(value)
    except TypeError:
        # The table of a part that is not loaded contains dictionaries.
        return 0


def refuse_fields(faults: Sequence[tuple[str, object, str]]) -> None:
    """Raise an error for settings of a table.

    A validator of a table calls this function, so that the error names the settings.

    `faults`: path below the table, value and rule of each invalid setting. An empty sequence is
    valid.
    """
    if faults:
        raise PydanticCustomError(FIELDS_REFUSED, "fields are refused", {"faults": list(faults)})


def merge(base: dict[str, Any], changes: dict[str, Any], path: str = "") -> dict[str, Any]:
    """Return `base` with `changes`, table by table.

    A list replaces a list. A table with the keys "0", "1" and so on changes entries of a list.
    `path` is that of `base`, for messages. Raises ExperimentError if a list has no such entry.
    """
    merged = dict(base)
    for key, value in changes.items():
        base_value = merged.get(key)
        if isinstance(base_value, dict) and isinstance(value, dict):
            merged[key] = merge(base_value, value, f"{path}{key}.")
        elif isinstance(base_value, list) and isinstance(value, dict) and value:
            # A key of a tree from Python can be a number.
            changes_by_key = {str(index): entry for index, entry in value.items()}
            entries = {str(index): entry for index, entry in enumerate(base_value)}
            list_path = f"{path}{key}."
            for index in changes_by_key.keys() - entries.keys():
                raise ExperimentError(describe_missing_name(f"{list_path}{index}", index, entries))
            merged[key] = list(merge(entries, changes_by_key, list_path).values())
        else:
            merged[key] = value
    return merged


def describe_missing_name(path: str, name: str, names: Iterable[Any]) -> str:
    """Return the message about a path whose step `name` is not one of `names`."""
    return f"{path}: there is no {name!r} here; there are: {', '.join(map(str, names)) or 'none'}"


def to_plain_data(value: Any) -> Any:
    """Return a value as TOML has it, at all levels.

    Tables are dicts, tuples and arrays are lists, numbers of NumPy are numbers of Python, and paths
    are texts.
    """
    if isinstance(value, BaseModel):
        return value.model_dump(mode="json")
    if isinstance(value, Mapping):
        return {key: to_plain_data(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [to_plain_data(entry) for entry in value]
    # NumPy takes a while to load, so its types are recognized by their method.
    if hasattr(value, "tolist"):
        return value.tolist()
    return str(value) if isinstance(value, PurePath) else value


def format_validation_error(error: ValidationError, model: type[BaseModel]) -> str:
    """Return one line per error: path, value and rule."""
    return format_faults(error.errors(), lambda fault: _format_fault(fault, model))


def format_faults(faults: Sequence[Any], format_fault: Callable[[Any], str] = str) -> str:
    """Return a line for each of the first errors, and the number of further errors."""
    lines = [format_fault(fault) for fault in faults[:MAX_FAULTS]]
    n_unlisted = len(faults) - MAX_FAULTS
    if n_unlisted > 0:
        lines.append(f"and {n_unlisted:,} more")
    return "\n".join(lines)


def shorten(text: str) -> str:
    """Return a text, cut at `MAX_TEXT_LENGTH` characters."""
    return text if len(text) <= MAX_TEXT_LENGTH else f"{text[:MAX_TEXT_LENGTH]}..."


def format_value(value: object) -> str:
    """Return a value as text for a message."""
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(format_value, value))}]"
    return f"{value:g}" if isinstance(value, float) else repr(value)


def _format_fault(fault: Any, model: type[BaseModel]) -> str:
    path = shorten(".".join(str(step) for step in fault["loc"]))
    message = str(fault["msg"]).removeprefix("Value error, ")
    if fault["type"] == "tuple_type":
        # Files and the lab have lists, and a user may not know tuples.
        message = "input should be a list"
    if fault["type"] == "extra_forbidden":
        names = ", ".join(_find_table(fault["loc"], model).model_fields)
        return f"{path}: there is no such field; there are: {names}"
    if fault["type"] == "missing":
        return f"{path}: is missing"
    if fault["type"] == FIELDS_REFUSED:
        # The path of the experiment itself is empty.
        prefix = f"{path}." if path else ""
        return "\n".join(
            f"{prefix}{name} = {shorten(format_value(value))}: {rule}"
            for name, value, rule in fault["ctx"]["faults"]
        )
    if not path:
        return message
    value = fault["input"]
    if fault["type"] == "string_pattern_mismatch":
        description = _find_description(fault["loc"], model)
        message = describe_pattern(fault["ctx"]["pattern"], description)
    value_text = "this table" if isinstance(value, dict) else shorten(repr(value))
    if isinstance(value, float) and not math.isfinite(value):
        value_text = str(value)
    return f"{path} = {value_text}: {message[0].lower()}{message[1:]}"


def _find_description(location: Sequence[str | int], model: Any) -> str:
    """Return the description of a setting."""
    fields = _find_table(location, model).model_fields
    # An entry of a list has a number.
    return (fields[location[-1]].description or "") if location[-1] in fields else ""


def _find_table(location: Sequence[str | int], model: Any) -> Any:
    """Return the class of the table that has a setting."""
    *steps, _ = location
    for step in steps:
        # A number is the index of a table in a tuple of tables, which have the same fields.
        if isinstance(step, str):
            annotation = model.model_fields[step].annotation
            entry_types = getattr(annotation, "__args__", ())
            model = entry_types[0] if entry_types else annotation
    return model


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
                value=_format_setting(value),
                default=_format_setting(default_value) if has_default else "–",
                meaning=(field.description or "") if field else "",
            )


def _find_default(field: Any) -> Any:
    return PydanticUndefined if field is None else field.get_default(call_default_factory=True)


def _format_setting(value: Any) -> str:
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
