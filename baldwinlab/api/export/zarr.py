"""Write the dataset of a study as a Zarr store, chunk by chunk, to limit the required memory."""

from __future__ import annotations

from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from baldwinlab._version import __version__
from baldwinlab.api.export.formats import ExportFormat
from baldwinlab.core.deferred import xr
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.file_writing import atomic_path
from baldwinlab.core.files import EXPORT_MARK, enclosing_study
from baldwinlab.core.numbers import format_count
from baldwinlab.core.resources import require_resources
from baldwinlab.core.variables import PER_AGENT_DIMS
from baldwinlab.experiment.conditions import SWEEP
from baldwinlab.simulation.memory import estimate_tables
from baldwinlab.studies.open import open_conditions
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.sweeps.design import label_points

if TYPE_CHECKING:
    import zarr

MAX_CHUNK_ROWS: Final = 2**17
"""Maximum number of agents, of all generations, in a chunk of several runs."""
CONDITION_INDEX: Final = "condition_index"
"""Temporary variable: the index of a condition in the study."""


def write_zarr(study: StudyStore, path: Path, *, force: bool = False) -> str:
    """Write the runs of a study as a Zarr store of version 3; return the number of runs as text."""
    import zarr
    from zarr.storage import LocalStore

    study.require_runs()
    need = max(estimate_tables([(experiment, 1)]) for experiment in study.experiments.values())
    require_resources(f"one run of {study.location}", need, force=force)
    _require_new(path)
    data = open_conditions(study, list(study.experiments))
    recorded = [str(name) for name, variable in data.data_vars.items() if "run" in variable.dims]
    # The frame of the store: coordinates, attributes, and the variables that no run records.
    frame = data.drop_vars(recorded).assign(
        {CONDITION_INDEX: ("condition", np.arange(data.sizes["condition"]))}
    )
    if study.kind == SWEEP:
        frame = label_points(study, frame)
    conditions = frame[CONDITION_INDEX]
    frame = _convert_texts(frame.drop_vars(CONDITION_INDEX))
    frame.attrs["made_by"] = f"{EXPORT_MARK} {__version__}"
    with atomic_path(path, is_folder=True) as partial_path:
        store = LocalStore(partial_path)
        frame.to_zarr(store, mode="w-", zarr_format=3, consolidated=False)
        group = zarr.open_group(store, mode="r+")
        for name in recorded:
            _write_variable(group, data[name], conditions)
            # This releases the values of the variable, which were read for the chunks.
            data = data.drop_vars(name)
    n_runs = sum(len(study.runs(name)) for name in study.experiments)
    return f"{path}: {format_count(n_runs, 'run')}"


def _require_new(path: Path) -> None:
    """Raise RefusedError if the path exists, or if its folder is a study or does not exist."""
    if folder := enclosing_study(path):
        raise RefusedError(f"--out {path} is inside the study {folder}. Choose another path.")
    if not path.parent.is_dir():
        raise RefusedError(
            f"--out {path}: the folder {path.parent} does not exist. Create it or choose another "
            "path."
        )
    if path.exists():
        raise RefusedError(f"--out {path} exists. Choose another path or remove it.")


def _convert_texts(frame: xr.Dataset) -> xr.Dataset:
    """Return texts of variable length, because Zarr has no type for texts of fixed length."""
    texts = {
        name: variable.astype(np.dtypes.StringDType())
        for name, variable in frame.variables.items()
        if variable.dtype.kind == "U"
    }
    coordinates = {name: texts.pop(name) for name in frame.coords if name in texts}
    return frame.assign_coords(coordinates).assign(texts)


def _write_variable(group: zarr.Group, recorded: xr.DataArray, conditions: xr.DataArray) -> None:
    """Write a variable [condition, run, ...] chunk by chunk.

    `conditions` are the indices of the conditions in `recorded`, in the shape of the store: one
    dimension `condition`, or for a swept grid one dimension per field.
    """
    dims = (*conditions.dims, *recorded.dims[1:])
    sizes = (*conditions.shape, *recorded.shape[1:])
    chunks = _choose_chunks(recorded, conditions)
    array = group.create_array(
        str(recorded.name),
        shape=sizes,
        chunks=(*chunks, *sizes[len(chunks) :]),
        dtype=recorded.dtype,
        fill_value=np.nan if recorded.dtype.kind == "f" else 0,
        dimension_names=[str(dim) for dim in dims],
        attributes=recorded.attrs,
    )
    starts = [range(0, size, step) for size, step in zip(sizes, chunks, strict=False)]
    for corner in product(*starts):
        region = tuple(
            slice(start, start + step) for start, step in zip(corner, chunks, strict=True)
        )
        indices: npt.NDArray[np.intp] = conditions.values[region[:-1]]
        # [condition, run, ...]
        values = recorded[indices.ravel(), region[-1]].values
        array[region] = values.reshape(*indices.shape, *values.shape[1:])


def _choose_chunks(recorded: xr.DataArray, conditions: xr.DataArray) -> tuple[int, ...]:
    """Return the sizes of a chunk along the dimensions of the conditions and the runs.

    If runs are small, a chunk has several runs, and if all runs fit, also several conditions. In a
    swept grid, these are points of the last field, and the other fields have one point.
    """
    n_runs = recorded.sizes["run"]
    rows_of_run = 1
    for dim in PER_AGENT_DIMS:
        rows_of_run *= recorded.sizes.get(dim, 1)
    chunk_runs = max(1, min(n_runs, MAX_CHUNK_ROWS // rows_of_run))
    max_conditions = MAX_CHUNK_ROWS // (rows_of_run * chunk_runs)
    chunk_conditions = max(1, min(conditions.shape[-1], max_conditions))
    return (*[1] * (conditions.ndim - 1), chunk_conditions, chunk_runs)


FORMAT: Final = ExportFormat(
    name="zarr",
    content="the xarray dataset of all results with time series, in Zarr version 3; --force runs "
    "even if less memory is free than the estimate",
    write=write_zarr,
    suffix=".zarr",
    library="zarr",
    extra="exchange",
)
