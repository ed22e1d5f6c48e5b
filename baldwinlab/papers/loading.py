"""Reading and validation of the TOML files of a paper. An error is one sentence with the path."""

from __future__ import annotations

import hashlib
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError, ValidationInfo, field_validator

from baldwinlab.core.errors import BaldwinLabError
from baldwinlab.core.files import PAPER_FILE, parse_toml, read_bytes, read_text
from baldwinlab.experiment.fields import format_validation_error


class PaperError(BaldwinLabError, ValueError):
    """The paper is unknown or invalid."""


class DeclaredTable(BaseModel):
    """Base class of the tables in the files of a paper. Unknown keys are errors."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @field_validator("*", mode="before")
    @classmethod
    def _refuse_truth_values(cls, value: Any, info: ValidationInfo) -> Any:
        """Refuse true and false for numbers. Pydantic would read 1 and 0."""
        values = value if isinstance(value, list) else [value]
        is_flag = cls.model_fields[str(info.field_name)].annotation is bool
        if not is_flag and any(isinstance(item, bool) for item in values):
            raise ValueError("true and false are not allowed here")
        return value


Table = TypeVar("Table", bound=BaseModel)


def read_tables(path: Path) -> dict[str, Any]:
    """Return the tables of a TOML file. Raises PaperError."""
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


def digest_folder(folder: Path, names: Iterable[str]) -> dict[str, str]:
    """Return the SHA-256 of files of a folder, by the name of the file."""
    return {name: hashlib.sha256(read_content(folder / name)).hexdigest() for name in names}


def read_content(path: Path) -> bytes:
    """Return the bytes of a file of a paper. Raises PaperError."""
    try:
        return read_bytes(path, PAPER_FILE)
    except (OSError, ValueError) as error:
        raise PaperError(f"{path} cannot be read: {error}") from None


def validate_tables(
    model: type[Table], tree: dict[str, Any], path: Path, context: Any = None
) -> Table:
    """Validate the tables of a file. Raises PaperError with the first error.

    `context` is passed to the validators of the model.
    """
    try:
        return model.model_validate(tree, context=context)
    except ValidationError as error:
        raise PaperError(f"{path}: {_format_error(error, model)}") from None


def _format_error(error: ValidationError, model: type[BaseModel]) -> str:
    fault = error.errors()[0]
    if fault["loc"] and fault["type"] == "value_error":
        # The message of a validator already contains the value.
        message = fault["msg"].removeprefix("Value error, ")
        return f"{'.'.join(map(str, fault['loc']))}: {message}"
    return format_validation_error(error, model).splitlines()[0]
