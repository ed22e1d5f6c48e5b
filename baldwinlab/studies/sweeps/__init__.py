"""File of a sweep: one experiment with many values of its fields. See docs/reference/sweeps.md."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Discriminator, Field, Tag, ValidationError, field_validator, model_validator

from baldwinlab.core.files import SWEEP_FILE, parse_toml, read_text
from baldwinlab.core.numbers import SEED_LIMIT
from baldwinlab.experiment import ExperimentError, Fields
from baldwinlab.experiment.fields import format_faults, shorten

# Maximum number of points of a sweep.
MAX_POINTS = 10_000


class Range(Fields):
    """Range of a field in a random or a Sobol sample, from `low` to `high` inclusive."""

    low: float
    high: float
    scale: Literal["linear", "log"] = "linear"

    @model_validator(mode="after")
    def _check_bounds(self) -> Self:
        if not self.low < self.high:
            raise ValueError(f"low {self.low:g} must be less than high {self.high:g}")
        if self.scale == "log" and self.low <= 0:
            raise ValueError(f"low {self.low:g} must be more than 0 on a log scale")
        return self

    def number(self, share: float) -> float:
        """Return the number at a fraction `share` (0 to 1) of the range, on this scale."""
        return self._interpolate(self.low, self.high, share)

    def integer(self, share: float) -> int:
        """Return the integer at a fraction `share` (0 to 1) of the range, on this scale."""
        low = math.ceil(self.low)
        high = math.floor(self.high)
        # Integer k covers the interval from k to k + 1. On the linear scale all are equally likely.
        value = self._interpolate(low, high + 1, share)
        return min(math.floor(value), high)

    def _interpolate(self, low: float, high: float, share: float) -> float:
        if self.scale == "log":
            value = low * math.exp(share * math.log(high / low))
        else:
            value = low + share * (high - low)
        # A rounding error can lead out of the range.
        return min(max(value, low), high)


def _choose_tag(value: Any) -> str:
    return "range" if isinstance(value, dict | Range) else "values"


Values = Annotated[list[Any], Field(min_length=1)]


class Sweep(Fields):
    """Content of the file of a sweep. `design.expand_sweep` checks that the fields exist."""

    experiment: str = Field(min_length=1)
    runs: int = Field(10, ge=1)
    seed: int = Field(0, ge=0, lt=SEED_LIMIT)
    design: Literal["grid", "list", "random", "sobol"] = "grid"
    samples: int | None = Field(None, ge=1, le=MAX_POINTS)
    fixed: dict[str, Any] = Field({}, alias="set")
    fields: dict[
        str,
        Annotated[
            Annotated[Values, Tag("values")] | Annotated[Range, Tag("range")],
            Discriminator(_choose_tag),
        ],
    ]

    @field_validator("fixed", "fields", mode="before")
    @classmethod
    def _flatten_tables(cls, tables: Any) -> Any:
        """Flatten tables: `[learning] rate = 1` becomes `"learning.rate" = 1`."""
        return dict(_flatten(tables)) if isinstance(tables, dict) else tables

    @model_validator(mode="after")
    def _check_fields(self) -> Self:
        if not self.fields:
            raise ValueError("fields: name at least one field to sweep")
        for path in (*self.fixed, *self.fields):
            if path == "name":
                raise ValueError("name: a sweep names its points itself")
        for swept in self.fields:
            other_fields = (field for field in self.fields if field != swept)
            for path in (*self.fixed, *other_fields):
                if path == swept or path.startswith(f"{swept}."):
                    raise ValueError(f"{path}: is set here, but {swept} is swept; keep one of them")
        return self

    @model_validator(mode="after")
    def _check_values(self) -> Self:
        values_by_path = {f"set.{path}": [value] for path, value in self.fixed.items()}
        values_by_path |= {f"fields.{path}": values for path, values in self.lists.items()}
        paths = [path for path, values in values_by_path.items() if not all(map(_is_plain, values))]
        if paths:
            raise ValueError(
                f"{shorten(', '.join(paths))}: "
                "a value must be a number, true or false, a text, or a list or a table of these"
            )
        return self

    @model_validator(mode="after")
    def _check_design(self) -> Self:
        if self.design in ("random", "sobol"):
            if self.samples is None:
                raise ValueError(
                    f'samples: is missing; design = "{self.design}" needs the number of points'
                )
            return self
        if self.samples is not None:
            raise ValueError(
                f'samples = {self.samples}: only design = "random" and "sobol" have samples'
            )
        ranges = [f"fields.{path}" for path in self.fields if path not in self.lists]
        if ranges:
            raise ValueError(
                f'{shorten(", ".join(ranges))}: a range needs design = "random" or "sobol"; '
                f"a {self.design} needs a list"
            )
        lengths = {path: len(values) for path, values in self.lists.items()}
        if self.design == "list" and len(set(lengths.values())) > 1:
            counts = ", ".join(f"{path} has {length}" for path, length in lengths.items())
            raise ValueError(f"fields: a list needs as many values of every field, and {counts}")
        is_grid = self.design == "grid"
        n_points = math.prod(lengths.values()) if is_grid else max(lengths.values())
        if n_points > MAX_POINTS:
            raise ValueError(
                f"fields: this {self.design} has {n_points:,} points; "
                f"at most {MAX_POINTS:,} are allowed"
            )
        return self

    @property
    def lists(self) -> dict[str, list[Any]]:
        """The fields that have a list of values."""
        return {
            path: values for path, values in self.fields.items() if not isinstance(values, Range)
        }


def _flatten(tables: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the path and the value of each field of nested tables."""
    for key, value in tables.items():
        is_range = isinstance(value, dict) and bool({"low", "high"} & value.keys())
        if isinstance(value, dict) and not is_range:
            yield from _flatten(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def _is_plain(value: Any) -> bool:
    if isinstance(value, list | dict):
        return all(map(_is_plain, value.values() if isinstance(value, dict) else value))
    return isinstance(value, bool | int | float | str)


def read_sweep(path: Path) -> Sweep:
    """Return the sweep in a TOML file. Raises ExperimentError with a line for every fault."""
    try:
        tree = parse_toml(read_text(path, SWEEP_FILE))
    except tomllib.TOMLDecodeError as error:
        raise ExperimentError(f"{path} is not TOML: {error}") from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise ExperimentError(f"cannot read {path}: {reason}") from None
    return validate_sweep(tree, str(path))


def validate_sweep(tree: Mapping[str, Any], where: str) -> Sweep:
    """Return the sweep that a parsed file describes."""
    try:
        return Sweep.model_validate(tree)
    except ValidationError as error:
        raise ExperimentError(
            format_faults(error.errors(), lambda fault: f"{where}: {_format_fault(fault)}")
        ) from None


def _format_fault(fault: Any) -> str:
    location = [str(key) for key in fault["loc"]]
    if location[:1] == ["fields"]:
        # pydantic adds the tag of the union: "values" or "range".
        del location[2:3]
    where = shorten(".".join(location))
    message = str(fault["msg"]).removeprefix("Value error, ")
    if fault["type"] == "extra_forbidden":
        is_in_range = len(location) > 1
        model = Range if is_in_range else Sweep
        names = [field.alias or name for name, field in model.model_fields.items()]
        return f"{where}: there is no such key; there are: {', '.join(names)}"
    if fault["type"] == "missing":
        return f"{where}: is missing"
    if not where or isinstance(fault["input"], dict):
        return f"{where}: {message}" if where else message
    return f"{where} = {shorten(repr(fault['input']))}: {message[0].lower()}{message[1:]}"
