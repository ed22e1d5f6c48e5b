"""Write the runs of a study as a Zarr store, chunk by chunk, to limit the required memory."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab._version import __version__
from baldwinlab.api.export.extra import require_extra
from baldwinlab.api.export.table import FILE_MARK
from baldwinlab.core.deferred import xr
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.file_writing import atomic_path
from baldwinlab.core.output_paths import enclosing_study
from baldwinlab.core.variables import PER_AGENT_DIMS, window_coordinates, without_genomes
from baldwinlab.experiment.factors import SWEEP
from baldwinlab.studies.open import concat_conditions
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.sweeps.design import label_points

if TYPE_CHECKING:
    import zarr

MAX_CHUNK_ROWS: Final = 2**17
"""Maximum number of agents, of all generations, in a chunk of several runs."""
INDEX_COORDINATE: Final = "condition_index"
"""Temporary variable: the number of a condition in the study."""


class Layout(NamedTuple):
    """The dataset of a study without the recorded values."""

    frame: xr.Dataset  # Coordinates, attributes, and the variables without the dimension `run`.
    # A sample of each recorded variable, one value per condition, with its attributes.
    recorded: Mapping[str, xr.DataArray]
    sizes: Mapping[str, int]
    runs: Mapping[str, npt.NDArray[np.int32]]  # Numbers of the stored runs, by condition.
    # Whether conditions differ in their runs, generations or agents, or runs can stop.
    has_gaps: bool
    # Numbers of the conditions in the study, in the shape of the dataset's condition dimensions.
    conditions: npt.NDArray[np.intp]


def write_zarr(study: StudyStore, path: Path) -> None:
    """Write the runs of a study as a Zarr store of version 3, chunk by chunk."""
    with require_extra("a Zarr store"):
        import zarr
        from zarr.storage import LocalStore
    if folder := enclosing_study(path):
        raise RefusedError(f"--out {path} is inside the study {folder}. Choose another path.")
    if not path.parent.is_dir():
        raise RefusedError(
            f"--out {path}: the folder {path.parent} does not exist. Create it or choose another "
            "path."
        )
    if path.exists():
        raise RefusedError(f"--out {path} exists. Choose another path or remove it.")
    layout = _make_layout(study)
    frame = _convert_texts(layout.frame)
    frame.attrs["made_by"] = f"{FILE_MARK} {__version__}"
    with atomic_path(path, is_folder=True) as partial_path:
        frame.to_zarr(LocalStore(partial_path), mode="w-", zarr_format=3, consolidated=False)
        _write_records(study, layout, zarr.open_group(LocalStore(partial_path), mode="r+"))


def _convert_texts(frame: xr.Dataset) -> xr.Dataset:
    """Return the dataset with texts of variable length.

    The Zarr specification has no data type for texts of fixed length.
    """
    texts = {
        name: variable.astype(np.dtypes.StringDType())
        for name, variable in frame.variables.items()
        if variable.dtype.kind == "U"
    }
    coordinates = {name: texts.pop(name) for name in frame.coords if name in texts}
    return frame.assign_coords(coordinates).assign(texts)


def _make_layout(study: StudyStore) -> Layout:
    """Read one value of each condition, and return the layout of the dataset."""
    runs = {name: np.array(study.runs(name), np.int32) for name in study.experiments}
    _require_equal_windows(study)
    samples = [_read_sample(study, name, numbers) for name, numbers in runs.items()]
    data = concat_conditions(study, list(study.experiments), samples)
    data = data.assign({INDEX_COORDINATE: ("condition", np.arange(len(samples)))})
    if study.kind == SWEEP:
        data = label_points(study, data)
    recorded = {
        str(name): variable for name, variable in data.data_vars.items() if "run" in variable.dims
    }
    experiments = study.experiments.values()
    generations = {experiment.evolution.generations for experiment in experiments}
    agents = {experiment.population.size for experiment in experiments}
    coords = {"run": np.unique(np.concatenate(list(runs.values())))}
    for dim, sizes_of_dim in zip(PER_AGENT_DIMS, (generations, agents), strict=True):
        coords[dim] = np.arange(max(sizes_of_dim), dtype=np.int32)
    frame = data.drop_vars([INDEX_COORDINATE, *recorded]).drop_dims(list(coords))
    frame = frame.assign_coords(
        {dim: (dim, values, data[dim].attrs) for dim, values in coords.items()}
    )
    has_missing_runs = any(len(numbers) < len(coords["run"]) for numbers in runs.values())
    may_stop = any(experiment.may_stop for experiment in experiments)
    has_unequal_sizes = len(generations) > 1 or len(agents) > 1
    has_gaps = has_missing_runs or may_stop or has_unequal_sizes
    sizes = {str(dim): size for dim, size in (*data.sizes.items(), *frame.sizes.items())}
    return Layout(
        frame=frame,
        recorded=recorded,
        sizes=sizes,
        runs=runs,
        has_gaps=has_gaps,
        conditions=data[INDEX_COORDINATE].values.astype(np.intp),
    )


def _require_equal_windows(study: StudyStore) -> None:
    """Raise RefusedError if the time series of conditions have different windows."""
    all_starts = [
        tuple(coordinates["window"])
        for experiment in study.experiments.values()
        if (coordinates := window_coordinates(experiment))
    ]
    if len({*all_starts}) > 1:
        raise RefusedError(
            f"{study.location}: --format zarr needs equal windows of the time series, so "
            "record.every and lifetime.steps must be equal in all conditions with time series"
        )


def _read_sample(study: StudyStore, name: str, runs: npt.NDArray[np.int32]) -> xr.Dataset:
    """Return the first value of each variable. A condition without runs has an empty dataset."""
    first_entries = {dim: [0] for dim in PER_AGENT_DIMS}
    if not runs.size:
        from baldwinlab.studies.lazy_runs import make_empty_dataset

        return make_empty_dataset(study.experiments[name]).isel(first_entries)
    return study.read(name, int(runs[0]), genomes=False).isel(first_entries).expand_dims(run=[0])


def _write_records(study: StudyStore, layout: Layout, group: zarr.Group) -> None:
    """Write all chunks. A run is in one chunk, so each record is read once."""
    n_runs = len(layout.frame["run"])
    rows_of_run = layout.sizes["generation"] * layout.sizes["agent"]
    chunk_runs = max(1, min(n_runs, MAX_CHUNK_ROWS // rows_of_run))
    max_conditions = MAX_CHUNK_ROWS // (rows_of_run * chunk_runs)
    chunk_conditions = max(1, min(layout.conditions.shape[-1], max_conditions))
    # A chunk has one point of each field of a sweep, and several points of the last field.
    chunk_shape = (*[1] * (layout.conditions.ndim - 1), chunk_conditions, chunk_runs)
    arrays = {
        name: _create_array(group, name, sample, layout, chunk_shape)
        for name, sample in layout.recorded.items()
    }
    shape = (*layout.conditions.shape, n_runs)
    starts = [range(0, size, step) for size, step in zip(shape, chunk_shape, strict=True)]
    for corner in product(*starts):
        region = tuple(
            slice(start, start + step) for start, step in zip(corner, chunk_shape, strict=True)
        )
        _write_chunk(study, layout, arrays, region)


def _write_chunk(
    study: StudyStore,
    layout: Layout,
    arrays: Mapping[str, zarr.Array[Any]],
    region: tuple[slice, ...],
) -> None:
    """Write one chunk of each array. Missing runs, generations and agents have the fill value."""
    conditions = layout.conditions[region[:-1]]
    runs = layout.frame["run"].values[region[-1]]
    chunks = {}
    for name, array in arrays.items():
        shape = (*conditions.shape, len(runs), *array.shape[len(region) :])
        chunks[name] = np.full(shape, array.fill_value, array.dtype)
    for index, record in _read_records(study, layout, conditions, runs):
        for variable_name, variable in record.data_vars.items():
            entries = tuple(slice(size) for size in variable.shape)
            chunks[str(variable_name)][index + entries] = variable.values
    for name, array in arrays.items():
        array[region] = chunks[name]


def _create_array(
    group: zarr.Group,
    name: str,
    sample: xr.DataArray,
    layout: Layout,
    chunk_shape: tuple[int, ...],
) -> zarr.Array[Any]:
    """Create the array of a recorded variable. Missing values are NaN.

    `chunk_shape` has the dimensions of the conditions and the dimension `run`.
    """
    dims = [str(dim) for dim in sample.dims]
    shape = [layout.sizes[dim] for dim in dims]
    dtype = np.result_type(sample.dtype, np.float32) if layout.has_gaps else sample.dtype
    return group.create_array(
        name,
        shape=shape,
        chunks=(*chunk_shape, *shape[len(chunk_shape) :]),
        dtype=dtype,
        fill_value=np.nan if dtype.kind == "f" else 0,
        dimension_names=dims,
        attributes=sample.attrs,
    )


def _read_records(
    study: StudyStore,
    layout: Layout,
    conditions: npt.NDArray[np.intp],
    runs: npt.NDArray[np.int32],
) -> Iterator[tuple[tuple[int, ...], xr.Dataset]]:
    """Yield the stored records of a chunk, with their indices (condition and run) in the chunk."""
    names = list(study.experiments)
    for index, condition in np.ndenumerate(conditions):
        name = names[condition]
        columns = {run: column for column, run in enumerate(runs.tolist())}
        for run, record in study.records(name, columns.keys()):
            yield (*index, columns[run]), without_genomes(record)
