"""A sweep: one experiment at many points of the space of its fields.

A sweep is a study whose conditions are its points, so it resumes and distributes like one. Beside what a study holds there is

    DIR/sweep.toml    the sweep's file as it was given; from it, results are labelled with the fields that were swept

The random samples are NumPy's; the quasi-random ones are I. M. Sobol's (USSR Computational Mathematics and Mathematical
Physics 7, 1967), scrambled as A. B. Owen proposed (Journal of Complexity 14, 1998), drawn by SciPy.
"""

from __future__ import annotations

import itertools
import math
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
import numpy.typing as npt
import tomlkit
import xarray as xr
from pydantic import BaseModel, Discriminator, Field, Tag, ValidationError, field_validator, model_validator
from scipy.stats import qmc

from baldwinlab import presets, store
from baldwinlab.config import Experiment, ExperimentError, Part, assign
from baldwinlab.files import write_atomically
from baldwinlab.simulate import SEED_LIMIT
from baldwinlab.store import Study, StudyError
from baldwinlab.study import open_study

MOST_POINTS = 10_000
FILE = "sweep.toml"


class Range(Part):
    """What a field may be in a random or a Sobol sample: a number from `low` to `high`, both included."""

    low: float
    high: float
    scale: Literal["linear", "log"] = "linear"

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if not self.low < self.high:
            raise ValueError(f"low {self.low:g} must be less than high {self.high:g}")
        if self.scale == "log" and self.low <= 0:
            raise ValueError(f"low {self.low:g} must be more than 0 on a log scale")
        return self

    def number(self, share: float) -> float:
        """The number that lies `share` (0 to 1) of the way from low to high, on this scale."""
        return self._between(self.low, self.high, share)

    def whole_number(self, share: float) -> int:
        """A whole number from low to high; on the linear scale all are as likely."""
        low, high = math.ceil(self.low), math.floor(self.high)
        return min(math.floor(self._between(low, high + 1, share)), high)

    def _between(self, low: float, high: float, share: float) -> float:
        if self.scale == "log":
            return min(max(low * math.exp(share * math.log(high / low)), low), high)
        return low + share * (high - low)


def _kind(value: Any) -> str:
    return "range" if isinstance(value, dict | Range) else "values"


Values = Annotated[tuple[Any, ...], Field(min_length=1)]


class Sweep(Part):
    """What a sweep's file says. Whether its fields are an experiment's, `experiments` finds out."""

    experiment: str = Field(min_length=1)
    runs: int = Field(10, ge=1)
    seed: int = Field(0, ge=0, lt=SEED_LIMIT)
    design: Literal["grid", "list", "random", "sobol"] = "grid"
    samples: int | None = Field(None, ge=1, le=MOST_POINTS)
    fixed: dict[str, Any] = Field({}, alias="set")
    fields: dict[str, Annotated[Annotated[Values, Tag("values")] | Annotated[Range, Tag("range")], Discriminator(_kind)]]

    @field_validator("fixed", "fields", mode="before")
    @classmethod
    def _by_path(cls, tables: Any) -> Any:
        """`learning.rate = 1`, `"learning.rate" = 1` and `[learning] rate = 1` are the same."""
        return dict(_leaves(tables)) if isinstance(tables, dict) else tables

    @model_validator(mode="after")
    def _fields_apart(self) -> Self:
        if not self.fields:
            raise ValueError("fields: name at least one field to sweep")
        for path in (*self.fixed, *self.fields):
            if path == "name":
                raise ValueError("name: a sweep names its points itself")
        for swept in self.fields:
            for path in (*self.fixed, *(other for other in self.fields if other != swept)):
                if path == swept or path.startswith(f"{swept}."):
                    raise ValueError(f"{path}: is set here, but {swept} is swept; keep one of them")
        return self

    @model_validator(mode="after")
    def _design_has_what_it_needs(self) -> Self:
        drawn = self.design in ("random", "sobol")
        if drawn and self.samples is None:
            raise ValueError(f'samples: is missing; design = "{self.design}" needs the number of points')
        if not drawn and self.samples is not None:
            raise ValueError(f'samples = {self.samples}: only design = "random" and "sobol" have samples')
        for path, values in self.fields.items():
            if isinstance(values, Range):
                if not drawn:
                    raise ValueError(f'fields.{path}: a range needs design = "random" or "sobol"; a {self.design} needs a list')
                continue
            if any(not _plain(value) for value in values):
                raise ValueError(f"fields.{path}: a value must be a number, true or false, a text, or a list of these")
        lengths = {path: len(values) for path, values in self.fields.items() if not isinstance(values, Range)}
        if self.design == "list" and len(set(lengths.values())) > 1:
            found = ", ".join(f"{path} has {length}" for path, length in lengths.items())
            raise ValueError(f"fields: a list needs as many values of every field, and {found}")
        points = math.prod(lengths.values()) if self.design == "grid" else max(lengths.values(), default=1)
        if self.design in ("grid", "list") and points > MOST_POINTS:
            raise ValueError(f"fields: this {self.design} has {points:,} points; at most {MOST_POINTS:,} are allowed")
        return self


def _leaves(tables: Mapping[str, Any], path: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in tables.items():
        if isinstance(value, dict) and not {"low", "high"} & value.keys():
            yield from _leaves(value, f"{path}{key}.")
        else:
            yield f"{path}{key}", value


def _plain(value: Any) -> bool:
    return all(map(_plain, value)) if isinstance(value, list) else isinstance(value, bool | int | float | str)


def read(path: Path) -> Sweep:
    """The sweep in a TOML file. Raises ExperimentError with a line for every fault."""
    try:
        return Sweep.model_validate(tomllib.loads(path.read_text("utf-8")))
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not UTF-8 text"
        raise ExperimentError(f"cannot read {path}: {reason}") from None
    except tomllib.TOMLDecodeError as error:
        raise ExperimentError(f"{path} is not TOML: {error}") from None
    except ValidationError as error:
        raise ExperimentError("\n".join(f"{path}: {_sentence(fault)}" for fault in error.errors())) from None


def _sentence(fault: Any) -> str:
    location = [str(step) for step in fault["loc"]]
    if location[:1] == ["fields"]:
        del location[2:3]  # whether it was read as a list or as a range
    where, message = ".".join(location), str(fault["msg"]).removeprefix("Value error, ")
    if fault["type"] == "extra_forbidden":
        part = Range if len(location) > 1 else Sweep
        names = [field.alias or name for name, field in part.model_fields.items()]
        return f"{where}: there is no such key; there are: {', '.join(names)}"
    if fault["type"] == "missing":
        return f"{where}: is missing"
    if not where or isinstance(fault["input"], dict):
        return f"{where}: {message}" if where else message
    return f"{where} = {fault['input']!r}: {message[0].lower()}{message[1:]}"


def experiments(sweep: Sweep, path: Path) -> list[Experiment]:
    """The points of a sweep, each a whole experiment: point-0000, point-0001, ...

    `path` is the sweep's file; an experiment given as a file is found relative to it. Points of a random or a Sobol sample
    are drawn from the sweep's seed, the same each time. Raises ExperimentError with a line for every fault.
    """
    base = _base(sweep, path)
    found: list[Experiment] = []
    faults: dict[str, str] = {}
    for number, point in enumerate(_points(sweep, base)):
        name = f"point-{number:04d}"
        try:
            found.append(assign(base, [f"name={name}", *_assignments(point)]))
        except ExperimentError as error:
            for line in str(error).splitlines():
                faults.setdefault(line, name)  # the first point that has it stands for all
    if faults:
        raise ExperimentError("\n".join(f"{path}: {name}: {line}" for line, name in faults.items()))
    _require_different(sweep, found, path)
    return found


def _base(sweep: Sweep, path: Path) -> Experiment:
    """The experiment as it is before any field is swept."""
    name = sweep.experiment
    try:
        base = assign(presets.load(path.parent / name if name.endswith(".toml") else name), _assignments(sweep.fixed))
        for field, values in sweep.fields.items():
            value, _ = _look_up(base, field)
            if isinstance(values, Range) and (isinstance(value, bool) or not isinstance(value, int | float)):
                raise ExperimentError(f"fields.{field}: {_text(value)} is not a number; give a list of what it may be")
            if isinstance(values, Range) and isinstance(value, int) and math.ceil(values.low) > math.floor(values.high):
                raise ExperimentError(f"fields.{field}: there is no whole number from {values.low:g} to {values.high:g}")
    except ExperimentError as error:
        raise ExperimentError("\n".join(f"{path}: {line}" for line in str(error).splitlines())) from None
    return base


def _points(sweep: Sweep, base: Experiment) -> Iterable[dict[str, Any]]:
    rows: Iterable[Sequence[Any]]
    if sweep.samples is None:
        columns = [values for values in sweep.fields.values() if not isinstance(values, Range)]
        rows = itertools.product(*columns) if sweep.design == "grid" else zip(*columns, strict=True)
    else:
        whole = [isinstance(_look_up(base, field)[0], int) for field in sweep.fields]
        rows = [
            [_pick(values, share, integer) for values, share, integer in zip(sweep.fields.values(), shares, whole, strict=True)]
            for shares in _shares(sweep, sweep.samples).tolist()
        ]
    return (dict(zip(sweep.fields, row, strict=True)) for row in rows)


def _shares(sweep: Sweep, samples: int) -> npt.NDArray[np.float64]:
    """`samples` points of the unit cube, [0, 1) in each field."""
    generator = np.random.default_rng(sweep.seed)
    if sweep.design == "random":
        return generator.random((samples, len(sweep.fields)))
    sobol = qmc.Sobol(len(sweep.fields), scramble=True, rng=generator)
    return sobol.random_base2((samples - 1).bit_length())[:samples]  # a power of 2, or the points would lose their balance


def _pick(values: tuple[Any, ...] | Range, share: float, whole: bool) -> Any:
    if isinstance(values, Range):
        return values.whole_number(share) if whole else values.number(share)
    return values[int(share * len(values))]


def _assignments(values: Mapping[str, Any]) -> list[str]:
    return [f"{path}={tomlkit.item(value).as_string()}" for path, value in values.items()]


def _look_up(experiment: Experiment, path: str) -> tuple[Any, str]:
    """The value of a field, and what it means. Raises ExperimentError for a field that there is not."""
    value: Any = experiment
    meaning = ""
    for step in path.split("."):
        if isinstance(value, BaseModel) and step in type(value).model_fields:
            meaning = type(value).model_fields[step].description or ""
            value = getattr(value, step)
        elif isinstance(value, tuple) and step.isdecimal() and int(step) < len(value):
            value = value[int(step)]
        else:
            there = (
                type(value).model_fields if isinstance(value, BaseModel) else range(len(value) if isinstance(value, tuple) else 0)
            )
            raise ExperimentError(f"fields.{path}: there is no {step!r} here; there are: {', '.join(map(str, there)) or 'none'}")
    return value, meaning


def _text(value: Any) -> str:
    return value if isinstance(value, str) else tomlkit.item(list(value) if isinstance(value, tuple) else value).as_string()


def _labels(points: Iterable[Experiment], field: str) -> list[int | float] | list[str]:
    """What a field is at each point: numbers where all are, else text as in TOML."""
    values = [_look_up(point, field)[0] for point in points]
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in values):
        return values
    return [_text(value) for value in values]


def _require_different(sweep: Sweep, points: Sequence[Experiment], path: Path) -> None:
    """The values of a field in a grid must differ, or two points would be one."""
    for field, values in sweep.fields.items():
        if sweep.design == "grid" and not isinstance(values, Range) and len(set(_labels(points, field))) < len(values):
            raise ExperimentError(f"{path}: fields.{field} has a value twice; in a grid, each must be another")


def create(directory: Path, sweep: Sweep, path: Path) -> list[Experiment]:
    """Make the study of a sweep, or open the one that is there if it is the same; gives its points.

    `path` is the sweep's file, of which a copy is kept. Raises ExperimentError where a point cannot be, and StudyError if the
    directory holds anything else, as `store.create` does.
    """
    points = experiments(sweep, path)
    if is_sweep(directory) and (there := len(Study(directory).experiments)) != len(points):
        raise StudyError(f"{directory} holds another sweep: of {there} points, not {len(points)}; choose another --out")
    store.create(directory, points, sweep.seed)
    write_atomically(directory / FILE, path.read_bytes())
    return points


def is_sweep(directory: Path) -> bool:
    return (directory / FILE).exists()


def open_sweep(directory: str | Path) -> xr.Dataset:
    """All stored runs of a sweep as one dataset, labelled with the fields that were swept.

    A grid has the dims (each swept field, run, generation, agent); the other designs have (point, run, generation, agent),
    with the fields as coordinates along `point`. Runs that are not stored are NaN. Attributes: `design`, `fields`, `base` (the
    experiment that was swept), `seed`. Raises StudyError as `open_study` does, and for a study that is no sweep.
    """
    folder = Path(directory)
    study = Study(folder)
    if not is_sweep(folder):
        raise StudyError(f"{folder} is no sweep: it has no {FILE}")
    sweep = read(folder / FILE)
    points = list(study.experiments.values())
    labels = {field: _labels(points, field) for field in sweep.fields}
    places = {"point": np.arange(len(points), dtype=np.int32)} | {field: ("point", labels[field]) for field in labels}
    data = open_study(folder).rename(condition="point").assign_coords(places)
    if sweep.design == "grid":
        data = _as_grid(data, list(labels))
    for field in labels:
        data[field].attrs["long_name"] = _look_up(points[0], field)[1]
    return data.assign_attrs(design=sweep.design, fields=list(labels), base=sweep.experiment)


def _as_grid(data: xr.Dataset, fields: Sequence[str]) -> xr.Dataset:
    """Points that are every combination of the fields' values, in the order of the file."""
    order = {field: list(dict.fromkeys(data[field].values)) for field in fields}
    if len(fields) == 1:
        return data.swap_dims(point=fields[0]).drop_vars("point")
    return data.set_index(point=fields).unstack("point").sel(order).transpose(*fields, ...)
