"""A sweep: one experiment at many points of the space of its fields.

A sweep is a study whose conditions are its points, so it resumes and distributes like one. Beside what a study holds there is

    DIR/sweep.toml    the sweep's file as it was given; from it, results are labelled with the fields that were swept

The random samples are NumPy's; the quasi-random ones are I. M. Sobol's (USSR Computational Mathematics and Mathematical
Physics 7, 1967), scrambled as A. B. Owen proposed (Journal of Complexity 14, 1998), drawn by SciPy.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import tomlkit
import xarray as xr

from baldwinlab.core.files import parse_location
from baldwinlab.experiment import Experiment, ExperimentError, assign, look_up
from baldwinlab.experiment.factors import SWEEP
from baldwinlab.experiment.fields import lines
from baldwinlab.experiment.miniworld import LONGEST_LIFE
from baldwinlab.experiment.paths import name_of
from baldwinlab.experiment.unused_settings import describe_idle, idle_fields
from baldwinlab.papers import presets
from baldwinlab.studies.open import open_conditions
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.sweeps.file import Range, Sweep, read_stored

FILE = "sweep.toml"


def expand_sweep(sweep: Sweep, path: Path) -> list[Experiment]:
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
        raise ExperimentError(lines([f"{path}: {name}: {line}" for line, name in faults.items()]))
    _require_different(sweep, found, path)
    _require_effect(sweep, found, path)
    return found


def _base(sweep: Sweep, path: Path) -> Experiment:
    """The experiment as it is before any field is swept."""
    name = sweep.experiment
    try:
        base: Experiment = assign(
            presets.load(path.parent / name if name.endswith(".toml") else name),
            _assignments(sweep.fixed),
        )
        for field, values in sweep.fields.items():
            value, _ = _look_up(base, field)
            if isinstance(values, Range) and (
                isinstance(value, bool) or not isinstance(value, int | float)
            ):
                raise ExperimentError(
                    f"fields.{field}: {_text(value)} is not a number; give a list of what it may be"
                )
            if (
                isinstance(values, Range)
                and isinstance(value, int)
                and math.ceil(values.low) > math.floor(values.high)
            ):
                raise ExperimentError(
                    f"fields.{field}: there is no whole number from {values.low:g} to {values.high:g}"
                )
    except ExperimentError as error:
        raise ExperimentError(
            "\n".join(f"{path}: {line}" for line in str(error).splitlines())
        ) from None
    return base


def _points(sweep: Sweep, base: Experiment) -> Iterable[dict[str, Any]]:
    rows: Iterable[Sequence[Any]]
    if sweep.samples is None:
        columns = sweep.lists.values()
        rows = itertools.product(*columns) if sweep.design == "grid" else zip(*columns, strict=True)
    else:
        whole = [isinstance(_look_up(base, field)[0], int) for field in sweep.fields]
        rows = [
            [
                _pick(values, share, integer)
                for values, share, integer in zip(sweep.fields.values(), shares, whole, strict=True)
            ]
            for shares in _draw_shares(sweep, sweep.samples).tolist()
        ]
    return (dict(zip(sweep.fields, row, strict=True)) for row in rows)


def _draw_shares(sweep: Sweep, samples: int) -> npt.NDArray[np.float64]:
    """`samples` points of the unit cube, [0, 1) in each field."""
    generator = np.random.default_rng(sweep.seed)
    if sweep.design == "random":
        return generator.random((samples, len(sweep.fields)))
    from scipy.stats import qmc  # here, because it takes a second to load, and few sweeps need it

    sobol = qmc.Sobol(len(sweep.fields), scramble=True, rng=generator)
    return sobol.random_base2((samples - 1).bit_length())[
        :samples
    ]  # a power of 2, or the points would lose their balance


def _pick(values: list[Any] | Range, share: float, whole: bool) -> Any:
    if isinstance(values, Range):
        return values.whole_number(share) if whole else values.number(share)
    return values[int(share * len(values))]


def _assignments(values: Mapping[str, Any]) -> list[str]:
    return [f"{path}={tomlkit.item(value).as_string()}" for path, value in values.items()]


def _look_up(experiment: Experiment, path: str) -> tuple[Any, str]:
    """The value of a swept field, and what it means. Raises ExperimentError for a field that there is not.

    A number of steps that is not set, for life, is on an axis as many as the longest life has, as in the sweep's file.
    """
    try:
        value, meaning = look_up(experiment, path)
        return LONGEST_LIFE if value is None else value, meaning
    except ExperimentError as error:
        raise ExperimentError(f"fields.{error}") from None


def _text(value: Any) -> str:
    return (
        value
        if isinstance(value, str)
        else tomlkit.item(list(value) if isinstance(value, tuple) else value).as_string()
    )


def _labels(points: Iterable[Experiment], field: str) -> list[int | float] | list[str]:
    """What a field is at each point: numbers where all are, else text as in TOML."""
    values = [_look_up(point, field)[0] for point in points]
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in values):
        return values
    return [_text(value) for value in values]


def _require_different(sweep: Sweep, points: Sequence[Experiment], path: Path) -> None:
    """The values of a field in a grid must differ, or two points would be one."""
    for field, values in sweep.lists.items():
        if sweep.design == "grid" and len(set(_labels(points, field))) < len(values):
            raise ExperimentError(
                f"{path}: fields.{field} has a value twice; in a grid, each must be another"
            )


def _require_effect(sweep: Sweep, points: Sequence[Experiment], path: Path) -> None:
    """A field that has no effect at any point is refused; at some points, a sweep over parts has idle fields on purpose."""
    reasons = [idle_fields(point) for point in points]
    given = {f"set.{field}": field for field in sweep.fixed} | {
        f"fields.{field}": field for field in sweep.fields
    }
    idle = {
        key: field for key, field in given.items() if all(field in of_point for of_point in reasons)
    }
    if idle:
        faults = [f"{path}: {describe_idle(key, reasons[0][field])}" for key, field in idle.items()]
        raise ExperimentError(lines(faults))


def require_same_size(directory: Path, points: Sequence[Experiment]) -> None:
    """Raises StudyError if the directory holds a sweep of another number of points, whose names would say nothing of that."""
    if (directory / FILE).exists() and (there := len(StudyStore(directory).experiments)) != len(
        points
    ):
        raise StudyError(
            f"{directory} holds another sweep: of {there} points, not {len(points)}; choose another --out"
        )


def open_sweep(directory: str | Path) -> xr.Dataset:
    """Return the stored runs of a sweep as one dataset, by the values of the swept settings.

    Parameters
    ----------
    directory
        The directory of a sweep, or a URL that fsspec can open.

    Returns
    -------
    xarray.Dataset
        The variables of `open_runs`. A grid has one dimension per swept setting, then `run`,
        `generation` and `agent`. Another design has the dimension `point` with the settings as
        coordinates. Runs that are not stored are NaN. The attributes are `design`, `fields`, `base`
        (the swept experiment), `set` (its changed settings) and `seed`.

    Raises
    ------
    StudyError
        There is no study, or it is not a sweep.
    DamagedRecordError
        A stored run is damaged.
    """
    folder = parse_location(directory)
    study = StudyStore(folder)
    if study.kind != SWEEP or not (folder / FILE).exists():
        raise StudyError(f"{folder} is no sweep: it has no {FILE}")
    return label_points(study, open_conditions(study, list(study.experiments)))


def label_points(study: StudyStore, data: xr.Dataset) -> xr.Dataset:
    """What was opened of all points of a sweep, with the fields that were swept instead of the conditions' names."""
    sweep = read_stored(study.directory / FILE)
    points = list(study.experiments.values())
    labels = {field: _labels(points, field) for field in sweep.fields}
    places = {"point": np.arange(len(points), dtype=np.int32)} | {
        field: ("point", labels[field]) for field in labels
    }
    data = data.rename(condition="point").assign_coords(places)
    if sweep.design == "grid":
        data = _as_grid(data, list(labels))
    for field in labels:
        data[field].attrs["long_name"] = name_of(field, points[0])
    return data.assign_attrs(
        design=sweep.design,
        fields=list(labels),
        base=sweep.experiment,
        set=_assignments(sweep.fixed),
    )


def settings(study: StudyStore) -> dict[str, list[int | float] | list[str]]:
    """What each swept field, by its name in words, is at each point of a sweep; nothing where its file is gone."""
    points = list(study.experiments.values())
    return {name_of(field, points[0]): values for field, values in settings_by_path(study).items()}


def settings_by_path(study: StudyStore) -> dict[str, list[int | float] | list[str]]:
    """As `settings`, by the path of each field, such as learning.rate."""
    if not (study.directory / FILE).exists():
        return {}
    points = list(study.experiments.values())
    return {field: _labels(points, field) for field in read_stored(study.directory / FILE).fields}


def _as_grid(data: xr.Dataset, fields: Sequence[str]) -> xr.Dataset:
    """Points that are every combination of the fields' values, in the order of the file."""
    order = {field: list(dict.fromkeys(data[field].values)) for field in fields}
    if len(fields) == 1:
        return data.swap_dims(point=fields[0]).drop_vars("point")
    return data.set_index(point=fields).unstack("point").sel(order).transpose(*fields, ...)
