"""The files of a paper: TOML, read into what it declares; every fault is one sentence that names the file."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError, ValidationInfo, field_validator

from baldwinlab.core.errors import BaldwinLabError
from baldwinlab.core.files import PAPER_FILE, parse_toml, read_text


class PaperError(BaldwinLabError, ValueError):
    """A paper that there is not, or a folder that is not the paper it should be."""


class Declared(BaseModel):
    """What a file may say: these fields and no others."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @field_validator("*", mode="before")
    @classmethod
    def _truth_values_where_allowed(cls, value: Any, info: ValidationInfo) -> Any:
        """Refuse true and false for other keys, where pydantic would read them as the numbers 1 and 0."""
        values = value if isinstance(value, list) else [value]
        is_flag = cls.model_fields[str(info.field_name)].annotation is bool
        if not is_flag and any(isinstance(one, bool) for one in values):
            raise ValueError("true and false are not allowed here")
        return value


M = TypeVar("M", bound=BaseModel)


def read(path: Path) -> dict[str, Any]:
    """The tables of a TOML file. Raises PaperError."""
    try:
        return parse_toml(read_text(path, PAPER_FILE))
    except FileNotFoundError:
        raise PaperError(f"there is no {path}") from None
    except OSError as error:
        raise PaperError(f"{path} cannot be read: {error.strerror or error}") from None
    except tomllib.TOMLDecodeError as error:
        raise PaperError(f"{path} is not TOML: {error}") from None
    except ValueError as error:
        raise PaperError(f"{path} cannot be read: {error}") from None


def declared(model: type[M], tree: dict[str, Any], path: Path, context: Any = None) -> M:
    """What the tables of a file declare; `context` is for the model's validators. Raises PaperError with the first fault."""
    try:
        return model.model_validate(tree, context=context)
    except ValidationError as error:
        raise PaperError(f"{path}: {_sentence(error)}") from None


def _sentence(error: ValidationError) -> str:
    fault = error.errors()[0]
    place = ".".join(map(str, fault["loc"]))
    message = fault["msg"].removeprefix("Value error, ")
    if fault["type"] == "missing":
        return f"{place} is missing"
    if fault["type"] == "extra_forbidden":
        return f"{place}: there is no such key"
    if not place or fault["type"] == "value_error":
        return f"{place}: {message}" if place else message
    return f"{place} = {fault['input']!r}: {message[0].lower()}{message[1:]}"
