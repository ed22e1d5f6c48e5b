"""What every table of an experiment is made of: frozen fields with limits, units and meaning; faults in plain sentences."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any, Final

from pydantic import BaseModel, ConfigDict, ValidationError, field_validator
from pydantic_core import PydanticCustomError

from baldwinlab.core.errors import BaldwinLabError
from baldwinlab.experiment.renamed import new_path

MOST_FAULTS: Final = 10  # that are told; who mends these may see more
LONGEST: Final = 100  # characters of a path or a value
FIELDS_REFUSED: Final = (
    "fields_refused"  # the type of pydantic's errors that `refuse_fields` raises
)


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

    @field_validator("*", mode="before")
    @classmethod
    def _no_number_from_truth(cls, value: Any, info: Any) -> Any:
        """`true` is not 1: Python would take it so, and hide a slip."""
        if isinstance(value, bool) and cls.model_fields[info.field_name].annotation not in (
            bool,
            Any,
        ):
            raise ValueError("true and false are not numbers")
        return value


def refuse_fields(faults: Sequence[tuple[str, object, str]]) -> None:
    """Refuse fields of a table, each by its path below the table, its value and what is allowed.

    A validator of a table calls this, so that the error names these fields and not the table. It accepts no faults.
    """
    if faults:
        raise PydanticCustomError(FIELDS_REFUSED, "fields are refused", {"faults": list(faults)})


def merge(base: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    """`base` with `changes` laid over it, table by table; lists are replaced whole."""
    merged = dict(base)
    for key, value in changes.items():
        below = merged.get(key)
        merged[key] = (
            merge(below, value) if isinstance(below, dict) and isinstance(value, dict) else value
        )
    return merged


def plain(value: Any) -> Any:
    """Tables as dicts and tuples as lists, all the way down."""
    if isinstance(value, BaseModel):
        return value.model_dump(mode="json")
    if isinstance(value, dict):
        return {key: plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [plain(entry) for entry in value]
    return value


def sentences(error: ValidationError, model: type[BaseModel]) -> str:
    """One line a fault: its path, the value, what is allowed. `model` is what was to be made."""
    return lines(error.errors(), lambda fault: _sentence(fault, model))


def lines(faults: Sequence[Any], sentence: Callable[[Any], str] = str) -> str:
    """A line for each of the first few, and how many more there are."""
    shown = [sentence(fault) for fault in faults[:MOST_FAULTS]]
    return "\n".join(
        [
            *shown,
            *([f"and {len(faults) - MOST_FAULTS:,} more"] if len(faults) > MOST_FAULTS else []),
        ]
    )


def brief(text: str) -> str:
    """A text, or as much of it as is needed to recognise it."""
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}..."


def as_text(value: object) -> str:
    """Return a number, a text or a list for a message, numbers without needless digits."""
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(as_text, value))}]"
    return f"{value:g}" if isinstance(value, float) else repr(value)


def renamed(path: str, current: str) -> str:
    """Return the message for a setting whose path was renamed."""
    return f"{path} was renamed to {current}: use the new name"


def _sentence(fault: Any, model: type[BaseModel]) -> str:
    path = brief(".".join(str(step) for step in fault["loc"]))
    message = str(fault["msg"]).removeprefix("Value error, ")
    if fault["type"] == "extra_forbidden" and (current := new_path(path)):
        return renamed(path, current)
    if fault["type"] == "extra_forbidden":
        return f"{path}: there is no such field; there are: {', '.join(_names_beside(fault['loc'], model))}"
    if fault["type"] == "missing":
        return f"{path}: is missing"
    if fault["type"] == FIELDS_REFUSED:
        inside = ((f"{path}.{name}".lstrip("."), *rest) for name, *rest in fault["ctx"]["faults"])
        return "\n".join(
            f"{name} = {brief(as_text(value))}: {rule}" for name, value, rule in inside
        )
    if not path:
        return message
    value = fault["input"]
    shown = brief(repr(value)) if not isinstance(value, dict) else "this table"
    if isinstance(value, float) and not math.isfinite(value):
        shown = str(value)
    return f"{path} = {shown}: {message[0].lower()}{message[1:]}"


def _names_beside(location: Iterable[str | int], model: Any) -> list[str]:
    """The fields there are where an unknown one was given."""
    steps = list(location)[:-1]
    for step in steps:
        if isinstance(step, str):
            annotation = model.model_fields[step].annotation
            inside = getattr(annotation, "__args__", ())
            model = inside[0] if inside else annotation
    return list(model.model_fields)
