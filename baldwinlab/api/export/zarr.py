"""A study as a Zarr store: the dataset that all its runs make, written chunk by chunk, so that it need not fit in memory."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr

from baldwinlab._version import __version__
from baldwinlab.api.export.extra import require_extra
from baldwinlab.api.export.table import MARK
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.files import atomic_path
from baldwinlab.core.output_paths import owner
from baldwinlab.core.variables import OF_AGENT
from baldwinlab.experiment.factors import SWEEP
from baldwinlab.studies.open import concat_conditions, make_empty_dataset
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.sweeps.design import label_points

if TYPE_CHECKING:
    import zarr

ROWS: Final = 2**17  # agents of all generations in a chunk, unless one run has more
PLACE: Final = (
    "place"  # of a condition in the study, by which its place among the fields of a grid is found
)


class Layout(NamedTuple):
    """The dataset of a study but for what is recorded, of which it knows the shape."""

    frame: xr.Dataset  # its coordinates and attributes, and what is of conditions
    recorded: Mapping[str, xr.DataArray]  # a value of each condition, with its attributes
    sizes: Mapping[str, int]
    runs: Mapping[
        str, npt.NDArray[np.int32]
    ]  # that are stored, by condition: listed once, as there may be a million
    gaps: bool  # whether any condition lacks a run, a generation or an agent that another has
    places: npt.NDArray[
        np.intp
    ]  # the number of the condition at each place, of as many dims as conditions have


def write_zarr(study: StudyStore, path: Path) -> None:
    """Write the runs of a study as a Zarr store of version 3, chunk by chunk.

    Parameters
    ----------
    study
        The directory of the study.
    path
        The folder to create.

    Raises
    ------
    RefusedError
        `path` exists, or is inside a study, or a library is missing.
    StudyError
        No run is stored, or a record is damaged.
    """
    with require_extra("a Zarr store"):
        import zarr
        from zarr.storage import LocalStore
    if folder := owner(path):
        raise RefusedError(f"--out {path} is inside the study {folder}. Choose another path.")
    if not path.parent.is_dir():
        raise RefusedError(
            f"--out {path}: the folder {path.parent} does not exist. Create it or choose another "
            "path."
        )
    if path.exists():
        raise RefusedError(f"--out {path} exists. Choose another path or remove it.")
    layout = _layout(study)
    of_any_length = (
        np.dtypes.StringDType()
    )  # of text of one length, Zarr's specification says nothing
    texts = {
        name: one.astype(of_any_length)
        for name, one in layout.frame.variables.items()
        if one.dtype.kind == "U"
    }
    told = layout.frame.assign_coords(
        {name: texts.pop(name) for name in layout.frame.coords if name in texts}
    ).assign(texts)
    told.attrs["made_by"] = f"{MARK} {__version__}"
    with atomic_path(path) as partial:
        told.to_zarr(LocalStore(partial), mode="w-", zarr_format=3, consolidated=False)
        _write_records(study, layout, zarr.open_group(LocalStore(partial), mode="r+"))


def _layout(study: StudyStore) -> Layout:
    """What the dataset of all records has beside them, from one value of each condition."""
    runs = {name: np.array(study.runs(name), np.int32) for name in study.experiments}
    samples = [_sample(study, name, there) for name, there in runs.items()]
    found = concat_conditions(study, list(study.experiments), samples).assign(
        {PLACE: ("condition", np.arange(len(samples)))}
    )
    if study.kind == SWEEP:
        found = label_points(study, found)
    recorded = {
        str(name): variable for name, variable in found.data_vars.items() if "run" in variable.dims
    }
    coords = {"run": np.unique(np.concatenate(list(runs.values())))}
    shapes = {
        (one.evolution.generations, one.population.size) for one in study.experiments.values()
    }
    coords |= {
        dim: np.arange(max(there), dtype=np.int32)
        for dim, there in zip(OF_AGENT, zip(*shapes, strict=True), strict=True)
    }
    frame = found.drop_vars([PLACE, *recorded]).drop_dims(list(coords))
    frame = frame.assign_coords(
        {dim: (dim, values, found[dim].attrs) for dim, values in coords.items()}
    )
    gaps = len(shapes) > 1 or any(len(there) < len(coords["run"]) for there in runs.values())
    sizes = {str(dim): size for dim, size in (*found.sizes.items(), *frame.sizes.items())}
    return Layout(frame, recorded, sizes, runs, gaps, found[PLACE].values.astype(np.intp))


def _sample(study: StudyStore, name: str, runs: npt.NDArray[np.int32]) -> xr.Dataset:
    """The first value of each variable, of a condition without runs none."""
    first = {dim: [0] for dim in OF_AGENT}
    if not runs.size:
        return make_empty_dataset(study.experiments[name]).isel(first)
    return study.read(name, int(runs[0]), genomes=False).isel(first).expand_dims(run=[0])


def _write_records(study: StudyStore, layout: Layout, group: zarr.Group) -> None:
    """Chunk after chunk; each record is read once. A run lies in one chunk, and a chunk has several where they are small."""
    numbers, rows = layout.frame["run"].values, layout.sizes["generation"] * layout.sizes["agent"]
    runs = max(1, min(len(numbers), ROWS // rows))
    conditions = max(1, min(layout.places.shape[-1], ROWS // (rows * runs)))
    steps = (*[1] * (layout.places.ndim - 1), conditions, runs)
    arrays = {
        name: _array(group, name, sample, layout, steps) for name, sample in layout.recorded.items()
    }
    ends = (*layout.places.shape, len(numbers))
    for corner in product(*(range(0, end, step) for end, step in zip(ends, steps, strict=True))):
        where = tuple(slice(first, first + step) for first, step in zip(corner, steps, strict=True))
        places, chosen = layout.places[where[:-1]], numbers[where[-1]]
        chunks = {
            name: np.full(
                (*places.shape, len(chosen), *array.shape[len(where) :]),
                array.fill_value,
                array.dtype,
            )
            for name, array in arrays.items()
        }
        for index, record in _records(study, layout, places, chosen):
            for name, variable in record.data_vars.items():
                whole = tuple(slice(size) for size in variable.shape)
                chunks[str(name)][index + whole] = variable.values
        for name, array in arrays.items():
            array[where] = chunks[name]


def _array(
    group: zarr.Group, name: str, sample: xr.DataArray, layout: Layout, steps: tuple[int, ...]
) -> zarr.Array[Any]:
    """For what is recorded under this name; where anything is missing, it is NaN."""
    shape = [layout.sizes[str(dim)] for dim in sample.dims]
    dtype = np.result_type(sample.dtype, np.float32) if layout.gaps else sample.dtype
    fill = np.nan if dtype.kind == "f" else 0
    names, chunks = [str(dim) for dim in sample.dims], (*steps, *shape[len(steps) :])
    return group.create_array(
        name,
        shape=shape,
        chunks=chunks,
        dtype=dtype,
        fill_value=fill,
        dimension_names=names,
        attributes=sample.attrs,
    )


def _records(
    study: StudyStore, layout: Layout, places: npt.NDArray[np.intp], numbers: npt.NDArray[np.int32]
) -> Iterator[tuple[tuple[int, ...], xr.Dataset]]:
    """Those that are stored of these conditions and runs, each with its place among them."""
    names = list(study.experiments)
    for index, condition in np.ndenumerate(places):
        name = names[condition]
        for number in np.flatnonzero(np.isin(numbers, layout.runs[name])):
            yield (*index, int(number)), study.read(name, int(numbers[number]), genomes=False)
