"""Design of a sweep, which is a study of an experiment at several points of its fields.

The conditions of this study are the points. In addition to the files of a study, a sweep has

    DIR/sweep.toml    a copy of the file of the sweep, which names the swept fields

NumPy draws the random samples. SciPy draws the quasi-random sequences of I. M. Sobol (USSR
Computational Mathematics and Mathematical Physics 7, 1967), scrambled with the method of A. B. Owen
(Journal of Complexity 14, 1998).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from baldwinlab.core.deferred import xr
from baldwinlab.core.files import parse_location
from baldwinlab.experiment import Experiment, ExperimentError, assign, look_up
from baldwinlab.experiment.conditions import SWEEP
from baldwinlab.experiment.fields import format_faults, to_plain_data
from baldwinlab.experiment.miniworld_tables import MAX_LIFETIME_STEPS
from baldwinlab.experiment.paths import short_name
from baldwinlab.experiment.toml import format_assignments, format_inline
from baldwinlab.experiment.unused_settings import describe_unused_setting, list_unused_settings
from baldwinlab.papers import presets
from baldwinlab.studies.open import open_conditions
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.sweeps import Range, Sweep, read_sweep

SWEEP_FILE_NAME = "sweep.toml"


def expand_sweep(sweep: Sweep, path: Path) -> list[Experiment]:
    """Return the experiment at each point of a sweep: point-0000, point-0001, ...

    The seed of the sweep determines the points of a random or a Sobol sample. `path` is the file of
    the sweep. The path of an experiment in this file is relative to the folder of the file.
    """
    base = _load_base(sweep, path)
    points: list[Experiment] = []
    point_by_fault: dict[str, str] = {}
    for point_index, point in enumerate(_list_points(sweep, base)):
        name = f"point-{point_index:04d}"
        try:
            points.append(assign(base, [f"name={name}", *format_assignments(point)]))
        except ExperimentError as error:
            for fault in str(error).splitlines():
                # Report each fault only for its first point.
                point_by_fault.setdefault(fault, name)
    if point_by_fault:
        raise ExperimentError(
            format_faults([f"{path}: {name}: {fault}" for fault, name in point_by_fault.items()])
        )
    _require_different(sweep, points, path)
    _require_effect(sweep, points, path)
    return points


def _load_base(sweep: Sweep, path: Path) -> Experiment:
    """Return the experiment of a sweep with its fixed settings."""
    name = sweep.experiment
    source = path.parent / name if name.endswith(".toml") else name
    try:
        base: Experiment = assign(presets.load(source), format_assignments(sweep.fixed))
        for field, values in sweep.fields.items():
            value, _ = _look_up(base, field)
            if isinstance(values, Range):
                _require_number_in_range(field, value, values)
    except ExperimentError as error:
        message = "\n".join(f"{path}: {line}" for line in str(error).splitlines())
        raise ExperimentError(message) from None
    return base


def _require_number_in_range(field: str, value: Any, values: Range) -> None:
    """Raise ExperimentError if a range does not suit the type of a field."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ExperimentError(
            f"fields.{field}: {_format_value(value)} is not a number; give a list of values"
        )
    if isinstance(value, int) and math.ceil(values.low) > math.floor(values.high):
        raise ExperimentError(
            f"fields.{field}: there is no integer from {values.low:g} to {values.high:g}"
        )


def _list_points(sweep: Sweep, base: Experiment) -> Iterable[dict[str, Any]]:
    """Return the values of the swept fields at each point: {"learning.rate": 0.1}."""
    rows: Iterable[Sequence[Any]]
    if sweep.samples is None:
        value_lists = sweep.lists.values()
        is_grid = sweep.design == "grid"
        rows = itertools.product(*value_lists) if is_grid else zip(*value_lists, strict=True)
    else:
        base_values = [_look_up(base, field)[0] for field in sweep.fields]
        are_integers = [isinstance(value, int) for value in base_values]
        ranges = list(sweep.fields.values())
        rows = [
            list(map(_pick_value, ranges, shares, are_integers))
            for shares in _draw_shares(sweep, sweep.samples).tolist()
        ]
    return (dict(zip(sweep.fields, row, strict=True)) for row in rows)


def _draw_shares(sweep: Sweep, samples: int) -> npt.NDArray[np.float64]:
    """Draw points of the unit cube: an array [sample, field] with values in [0, 1)."""
    generator = np.random.default_rng(sweep.seed)
    if sweep.design == "random":
        return generator.random((samples, len(sweep.fields)))
    # Imported late: the import takes a second, and few sweeps need it.
    from scipy.stats import qmc

    sobol = qmc.Sobol(len(sweep.fields), scramble=True, rng=generator)
    # A Sobol sequence is balanced only if its length is a power of 2, so a longer one is cut.
    exponent = (samples - 1).bit_length()
    return sobol.random_base2(exponent)[:samples]


def _pick_value(values: list[Any] | Range, share: float, is_integer: bool) -> Any:
    """Return the value at a fraction `share` of a range or of a list."""
    if isinstance(values, Range):
        return values.integer(share) if is_integer else values.number(share)
    return values[int(share * len(values))]


def _look_up(experiment: Experiment, path: str) -> tuple[Any, str]:
    """Return the value and the meaning of a field. Raises ExperimentError for an unknown field.

    An unset number of steps means "for life". The function returns the longest lifetime instead,
    so that figures and files contain a number.
    """
    try:
        value, meaning = look_up(experiment, path)
        return MAX_LIFETIME_STEPS if value is None else value, meaning
    except ExperimentError as error:
        raise ExperimentError(f"fields.{error}") from None


def _format_value(value: Any) -> str:
    if isinstance(value, str):
        return value
    return format_inline(to_plain_data(value))


def _setting_values(points: Iterable[Experiment], field: str) -> list[int | float] | list[str]:
    """Return the values of a field at all points, as numbers or else as TOML texts."""
    values = [value for value, _ in (_look_up(point, field) for point in points)]
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in values):
        return values
    return [_format_value(value) for value in values]


def _require_different(sweep: Sweep, points: Sequence[Experiment], path: Path) -> None:
    """Raise ExperimentError if a field of a grid has a value twice, so that points are equal."""
    if sweep.design != "grid":
        return
    for field, values in sweep.lists.items():
        n_distinct = len(set(_setting_values(points, field)))
        if n_distinct < len(values):
            raise ExperimentError(
                f"{path}: fields.{field} has a value twice; the values of a grid must differ"
            )


def _require_effect(sweep: Sweep, points: Sequence[Experiment], path: Path) -> None:
    """Raise ExperimentError for a field that has no effect at any point.

    A field may be without effect at some points. For example, a sweep of parts can also sweep a
    field that only one of the parts uses.
    """
    unused_by_point = [list_unused_settings(point) for point in points]
    field_by_key = {f"set.{field}": field for field in sweep.fixed}
    field_by_key |= {f"fields.{field}": field for field in sweep.fields}
    unused_everywhere = {
        key: field
        for key, field in field_by_key.items()
        if all(field in unused_settings for unused_settings in unused_by_point)
    }
    if unused_everywhere:
        reasons = unused_by_point[0]
        faults = [
            f"{path}: {describe_unused_setting(key, reasons[field])}"
            for key, field in unused_everywhere.items()
        ]
        raise ExperimentError(format_faults(faults))


def open_sweep(directory: str | Path) -> xr.Dataset:
    """Return the stored runs of a sweep as one dataset, by the values of the swept settings.

    A grid has one dimension per swept setting, another design has the dimension `point`. The method
    `data` of `baldwinlab.api.study.Study` describes the dataset. Raises `StudyError` if there is no
    sweep, and `DamagedRecordError`.
    """
    folder = parse_location(directory)
    study = StudyStore(folder)
    if study.kind != SWEEP or not (folder / SWEEP_FILE_NAME).exists():
        raise StudyError(f"{folder} is no sweep: it has no {SWEEP_FILE_NAME}")
    return label_points(study, open_conditions(study, list(study.experiments)))


def label_points(study: StudyStore, data: xr.Dataset) -> xr.Dataset:
    """Replace the dimension `condition` of the runs of a sweep as `open_sweep` describes."""
    sweep = read_sweep(study.directory / SWEEP_FILE_NAME)
    points = list(study.experiments.values())
    fields = list(sweep.fields)
    coordinates: dict[str, Any] = {"point": np.arange(len(points), dtype=np.int32)}
    for field in fields:
        coordinates[field] = ("point", _setting_values(points, field))
    data = data.rename(condition="point").assign_coords(coordinates)
    if sweep.design == "grid":
        data = _unstack_grid(data, fields)
    for field in fields:
        data[field].attrs["long_name"] = short_name(field, points[0])
    return data.assign_attrs(
        design=sweep.design,
        fields=fields,
        base=sweep.experiment,
        set=format_assignments(sweep.fixed),
    )


def settings_by_label(study: StudyStore) -> dict[str, list[int | float] | list[str]]:
    """Return `settings_by_path` with readable names of the fields as keys."""
    points = list(study.experiments.values())
    return {
        short_name(field, points[0]): values for field, values in settings_by_path(study).items()
    }


def settings_by_path(study: StudyStore) -> dict[str, list[int | float] | list[str]]:
    """Return the values of the swept fields at all points: {"learning.rate": [0.1, 0.2]}."""
    if not (study.directory / SWEEP_FILE_NAME).exists():
        return {}
    points = list(study.experiments.values())
    return {
        field: _setting_values(points, field)
        for field in read_sweep(study.directory / SWEEP_FILE_NAME).fields
    }


def name_points(study: StudyStore) -> dict[str, str]:
    """Return a title of each point of a sweep: {"point-0000": "learning.rule = hebb"}."""
    settings = settings_by_path(study)
    columns = [[f"{field} = {value}" for value in values] for field, values in settings.items()]
    all_names = [", ".join(values) for values in zip(*columns, strict=True)] or list(
        study.experiments
    )
    return {
        point: name if all_names.count(name) == 1 else f"{name} ({point})"
        for point, name in zip(study.experiments, all_names, strict=True)
    }


def _unstack_grid(data: xr.Dataset, fields: Sequence[str]) -> xr.Dataset:
    """Replace the dimension `point` by one dimension per field, in the order of the file."""
    values_in_order = {field: list(dict.fromkeys(data[field].values)) for field in fields}
    if len(fields) == 1:
        return data.swap_dims(point=fields[0]).drop_vars("point")
    return (
        data.set_index(point=fields).unstack("point").sel(values_in_order).transpose(*fields, ...)
    )
