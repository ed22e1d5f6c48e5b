"""Base class of the tables of an experiment, messages about invalid settings, and HTML tables.

A notebook shows an experiment as HTML tables of the settings, in the colors of the notebook.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from datetime import date, time
from html import escape
from pathlib import PurePath
from typing import Any, Final, NamedTuple, Self, get_origin

from pydantic import BaseModel, ConfigDict, ValidationError, field_validator
from pydantic_core import PydanticCustomError, PydanticUndefined

from baldwinlab.core.errors import BaldwinLabError
from baldwinlab.core.names import describe_pattern

MAX_FAULTS: Final = 10
"""Maximum number of errors in a message."""
MAX_TEXT_LENGTH: Final = 100
"""Maximum number of characters of a path or a value in a message."""
FIELDS_REFUSED: Final = "fields_refused"
"""Type of the pydantic errors that `refuse_fields` raises."""
LEFT_STYLE: Final = 'style="text-align: left; vertical-align: top"'


class ExperimentError(BaldwinLabError, ValueError):
    """The experiment is invalid. Each line names a setting, its value and the allowed values."""


class Fields(BaseModel):
    """Base class of the tables of an experiment.

    An unknown setting is an error, and so is true or false for a number.
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
        """Yield name and value of each setting. Pydantic would also yield cached properties."""
        for name in (*type(self).model_fields, *(self.model_extra or ())):
            yield name, getattr(self, name)

    @field_validator("*", mode="before")
    @classmethod
    def _normalize_numbers(cls, value: Any, info: Any) -> Any:
        """Refuse true and false, which Python reads as numbers. Convert values of NumPy."""
        value = to_plain_data(value) if hasattr(value, "tolist") else value
        accepts_truth = cls.model_fields[info.field_name].annotation in (bool, str, Any)
        if isinstance(value, bool) and not accepts_truth:
            raise ValueError("true and false are not numbers")
        return value


class HashedFields(Fields):
    """A table that computes its hash once.

    Experiments are keys of caches, which a simulation reads several times per generation.
    """

    def __hash__(self) -> int:
        # Pydantic does not treat a name with an underscore as a field.
        values = vars(self)
        if "_hash" not in values:
            hashes = [_hash_value(values[name]) for name in type(self).model_fields]
            values["_hash"] = hash((type(self), *hashes))
        return int(values["_hash"])

    def __copy__(self) -> Self:
        """Return a copy without the hash, because `model_copy` then changes the copy."""
        # Without arguments, `__new__` of an experiment would choose the class with default parts.
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
        # A dictionary has no hash. The table of a part that is not loaded is a dictionary.
        return 0


def refuse_fields(faults: Sequence[tuple[str, object, str]]) -> None:
    """Raise an error that names the invalid settings of a table. The table's validator calls it.

    `faults`: path in the table, value and violated rule of each setting, for example ("elite", 30,
    "must be at most population.size = 20"). Without faults, there is no error.
    """
    if faults:
        raise PydanticCustomError(FIELDS_REFUSED, "fields are refused", {"faults": list(faults)})


def merge(base: dict[str, Any], changes: dict[str, Any], path: str = "") -> dict[str, Any]:
    """Return `base` with `changes`, table by table.

    A list replaces a list. A table with the keys "0", "1" and so on changes entries of a list.
    `path`: path of `base`, for messages. Raises ExperimentError if a list has no such entry.
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
    """Return the message about a path with a step `name` that is not one of `names`."""
    return f"{path}: there is no {name!r} here; there are: {', '.join(map(str, names)) or 'none'}"


def to_plain_data(value: Any) -> Any:
    """Return a value with the types of TOML, at all levels.

    Tables become dicts, tuples and arrays lists, NumPy numbers Python numbers, and paths texts.
    """
    if isinstance(value, BaseModel):
        return value.model_dump(mode="json")
    if isinstance(value, Mapping):
        return {key: to_plain_data(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [to_plain_data(entry) for entry in value]
    # NumPy takes a while to load, so a method identifies the types of NumPy without an import.
    if hasattr(value, "tolist"):
        return value.tolist()
    return str(value) if isinstance(value, PurePath) else value


def format_validation_error(error: ValidationError, model: type[BaseModel]) -> str:
    """Return one line per error: path, value and violated rule."""
    return format_faults(error.errors(), lambda fault: _format_fault(fault, model))


def format_faults(faults: Sequence[Any], format_fault: Callable[[Any], str] = str) -> str:
    """Return a line for each of the first errors, and the number of further errors."""
    lines = [format_fault(fault) for fault in faults[:MAX_FAULTS]]
    n_unlisted = len(faults) - MAX_FAULTS
    if n_unlisted > 0:
        lines.append(f"and {n_unlisted:,} more")
    return "\n".join(lines)


def shorten(text: str) -> str:
    """Return a text. Only the first `MAX_TEXT_LENGTH` characters of a long text remain."""
    return text if len(text) <= MAX_TEXT_LENGTH else f"{text[:MAX_TEXT_LENGTH]}..."


def format_value(value: object) -> str:
    """Return a value as text for a message."""
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(format_value, value))}]"
    return f"{value:.10g}" if isinstance(value, float) else repr(value)


def _format_fault(fault: Any, model: type[BaseModel]) -> str:
    path = shorten(".".join(str(step) for step in fault["loc"]))
    message = str(fault["msg"]).removeprefix("Value error, ")
    if fault["type"] == "tuple_type":
        # Pydantic's message names a tuple, but files and the lab have lists.
        message = "input should be a list"
    if fault["type"] == "extra_forbidden":
        names = ", ".join(_find_fields(fault["loc"], model))
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
    if fault["type"] == "string_type":
        message = "must be a text; write it in quotes"
    value_text = "this table" if isinstance(value, dict) else shorten(repr(value))
    if isinstance(value, bool | date | time):
        # As in the file.
        value_text = str(value).lower()
    if isinstance(value, float) and not math.isfinite(value):
        value_text = str(value)
    return f"{path} = {value_text}: {message[0].lower()}{message[1:]}"


def _find_description(location: Sequence[str | int], model: Any) -> str:
    fields = _find_fields(location, model)
    # The location of an entry of a list ends with an index, which is not in `fields`.
    return (fields[location[-1]].description or "") if location[-1] in fields else ""


def _find_fields(location: Sequence[str | int], model: Any) -> Any:
    """Return the fields of the table with the last key of a location. Other values have none."""
    *steps, _ = location
    for step in steps:
        fields = getattr(model, "model_fields", {})
        # Other steps are indices of a tuple or keys of a dictionary, whose tables have one class.
        if step in fields:
            annotation = fields[step].annotation
            entry_types: tuple[Any, ...] = getattr(annotation, "__args__", (annotation,))
            model = entry_types[1] if get_origin(annotation) is dict else entry_types[0]
    return getattr(model, "model_fields", {})


class Row(NamedTuple):
    """A setting, as a row of a table."""

    path: str
    value: str
    # "–" if the setting has no default.
    default: str
    meaning: str

    @property
    def differs(self) -> bool:
        return self.value != self.default


def iterate_rows(table: BaseModel, default: Any = None, path: str = "") -> Iterator[Row]:
    """Yield a row per setting of a table at `path`. `default`: default values of the table."""
    # The experiment of a model that is not loaded has values without fields.
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
    """Return a value as shortened JSON. A text has no quotes."""
    if value is None:
        return "not set"
    return shorten(value if isinstance(value, str) else json.dumps(to_plain_data(value)))


def format_html(experiment: BaseModel, name: str, model: str) -> str:
    """Return two tables: the changed fields of an experiment, and a collapsed one of all fields."""
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
