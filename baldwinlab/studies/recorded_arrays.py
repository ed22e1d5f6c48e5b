"""Arrays that read stored runs when values are used. `lazy_runs.py` combines the arrays."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.io import netcdf_file
from xarray.backends import BackendArray
from xarray.core import indexing

from baldwinlab.core.deferred import pd, xr
from baldwinlab.core.netcdf import CHECKSUM_BYTES, decode_variables, from_bytes, stored_checksum
from baldwinlab.core.records import select_record, without_genomes
from baldwinlab.core.variables import PER_AGENT_DIMS
from baldwinlab.experiment import BaseExperiment
from baldwinlab.studies.record_files import RecordFile, StudyError
from baldwinlab.studies.records import (
    RunLengths,
    Variables,
    Version,
    read_verified,
    read_version,
    require_content,
)

GENERATION: Final = PER_AGENT_DIMS[0]
NO_INDEX: Final = -1
# Dimensions whose labels can differ between the files of a condition.
_LABELED_DIMS: Final = ("agent", "parent", "window")
# A variable of at most this size is read once as a whole, because often several parts are used.
MAX_WHOLE_BYTES: Final = 256 * 2**20
Indices = npt.NDArray[np.intp]


class FileLayout(NamedTuple):
    """Variables and labels of a record without genomes. Many files have the same layout."""

    # Each variable of a record, with dimensions, type and attributes, but with 0 generations.
    variables: Mapping[Hashable, xr.Variable]
    labels: Mapping[Hashable, xr.Variable]  # Labels of each dimension except "generation".


class FileContent(NamedTuple):
    """A verified file of records."""

    file: RecordFile
    experiment: BaseExperiment
    lengths: RunLengths
    layout: FileLayout
    checksum: str
    version: Version | None  # Version at the time of verification, None for a remote file.

    def read(self, name: Hashable) -> npt.NDArray[Any]:
        """Return the values of a variable [run, ...]. Shorter runs end in padding.

        Raises StudyError if the file has changed since its verification.
        """
        # Only this variable is read if the date and the size of the file have not changed.
        if self.version is not None and read_version(self.file.path) == self.version:
            values = _read_part(self.file.path, name)
        else:
            with read_verified(self.file, self.experiment) as raw:
                _, variables = decode_variables(raw)
                if stored_checksum(raw[:CHECKSUM_BYTES]) != self.checksum:
                    raise StudyError(
                        f"{self.file.path} has been changed since the study was opened: "
                        "open the study again"
                    )
            values = variables[name].values
        values = values.astype(self.layout.variables[name].dtype)
        # A file of one run has no dimension `run`.
        return values if self.file.is_batch else values[None]

    def indices(self, dim: Hashable, labels: npt.NDArray[Any]) -> npt.NDArray[np.intp]:
        """Return the index in this file of each label of a dimension, -1 for a missing label."""
        if dim == GENERATION:
            # The label of a generation is also its index.
            is_stored = labels < self.lengths.n_generations.max()
            return np.where(is_stored, labels, NO_INDEX).astype(np.intp)
        own_labels = self.layout.labels[dim].values
        if np.array_equal(own_labels, labels):
            return np.arange(len(labels))
        indices: npt.NDArray[np.intp] = pd.Index(own_labels).get_indexer(pd.Index(labels))
        return indices


def _read_part(path: Path, name: Hashable) -> npt.NDArray[Any]:
    """Return a variable of a verified file without reading the other variables."""
    try:
        with netcdf_file(str(path), mmap=True) as file:
            values: npt.NDArray[Any] = np.array(file.variables[str(name)].data)
    except OSError as error:
        raise StudyError(f"{path} cannot be read: {error.strerror or error}") from None
    return values


def open_file(
    file: RecordFile, experiment: BaseExperiment, seed: int, layouts: dict[Hashable, FileLayout]
) -> FileContent:
    """Verify a file of records, and return its content.

    `layouts`: the known layouts by `_layout_key`. The function adds a new layout.
    """
    # The version is read before the content, so that a change during the reading is noticed.
    version = read_version(file.path)
    with read_verified(file, experiment) as raw:
        attributes, variables = decode_variables(raw)
        lengths = require_content(attributes, variables, file, experiment, seed)
        key = _layout_key(variables)
        if key not in layouts:
            layouts[key] = _decode_layout(raw, file)
        checksum = stored_checksum(raw[:CHECKSUM_BYTES])
    return FileContent(file, experiment, lengths, layouts[key], checksum, version)


def _layout_key(variables: Variables) -> Hashable:
    """Return the types, dimensions and labels. Files with equal keys have the same layout."""
    types = tuple((name, variable.dims, variable.dtype) for name, variable in variables.items())
    labels = tuple(variables[dim].values.tobytes() for dim in _LABELED_DIMS if dim in variables)
    return types, labels


def _decode_layout(raw: bytes, file: RecordFile) -> FileLayout:
    data = from_bytes(raw)
    return make_layout(without_genomes(select_record(data, 0) if file.is_batch else data))


def make_layout(record: xr.Dataset) -> FileLayout:
    """Return the layout of a dataset of one run without genomes."""
    labels = {name: record.variables[name] for name in record.coords if name != GENERATION}
    without_values = record.isel({GENERATION: slice(0)})
    variables = {name: without_values.variables[name].copy() for name in record.data_vars}
    return FileLayout(variables, labels)


class RunIndex(NamedTuple):
    """The file and the row of each run of the dataset, in one condition."""

    files: Sequence[FileContent]
    # [run]: index in `files` of the file of each run, -1 for a run that is not stored.
    file_of_run: Indices
    row_of_run: Indices  # [run]: index of each run in this file.


class RecordedArray(BackendArray):
    """A variable of the stored runs, [condition, run, ...].

    - `dims`, `labels`: the dimensions after `run`, and the labels of each.
    - `dtype`: type of the values. It can hold NaN if a value is missing.
    - `runs`: the runs of each condition.
    """

    def __init__(
        self,
        name: Hashable,
        dims: Sequence[Hashable],
        labels: Mapping[Hashable, Any],
        dtype: np.dtype[Any],
        runs: Sequence[RunIndex],
    ) -> None:
        self._name = name
        self._dims = tuple(dims)
        self._labels = labels
        self._runs = runs
        self.dtype = dtype
        n_runs = len(runs[0].file_of_run)
        self.shape = (len(runs), n_runs, *(len(labels[dim]) for dim in dims))

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Any:
        outer = indexing.IndexingSupport.OUTER
        return indexing.explicit_indexing_adapter(key, self.shape, outer, self._select)

    def _select(self, key: tuple[Any, ...]) -> npt.NDArray[Any]:
        """Return the values at a key with an integer, a slice or indices for each dimension."""
        n_bytes = self.dtype.itemsize * int(np.prod(self.shape))
        if n_bytes <= MAX_WHOLE_BYTES:
            values = self._values[_orthogonal(key, self.shape)]
        else:
            values = self._read(_list_indices(key, self.shape))
        result: npt.NDArray[Any] = values.reshape(_result_shape(key, self.shape))
        return result

    @cached_property
    def _values(self) -> npt.NDArray[Any]:
        return self._read([np.arange(size) for size in self.shape])

    def _read(self, indices: Sequence[Indices]) -> npt.NDArray[Any]:
        """Return the values at these indices of each dimension. Missing values are NaN."""
        conditions, runs, *later_indices = indices
        values = np.zeros([len(positions) for positions in indices], self.dtype)
        if self.dtype.kind in "fO":
            values.fill(np.nan)
        for row, condition in enumerate(conditions):
            index = self._runs[condition]
            file_of_run = index.file_of_run[runs]
            # One sort groups the runs by file. It is faster than a search for the runs of each
            # file. `numbers` are the indices of the files. `starts` begins with 0, so the first
            # group of `np.split` is empty.
            order = np.argsort(file_of_run, kind="stable")
            numbers, starts = np.unique(file_of_run[order], return_index=True)
            for number, selected in zip(numbers, np.split(order, starts)[1:], strict=True):
                if number != NO_INDEX:
                    rows = index.row_of_run[runs[selected]]
                    self._read_file(index.files[number], rows, later_indices, values[row], selected)
        return values

    def _read_file(
        self,
        content: FileContent,
        rows: Indices,
        later_indices: Sequence[Indices],
        values: npt.NDArray[Any],
        selected: Indices,
    ) -> None:
        """Copy runs of a file into `values` [run, ...] of one condition.

        `rows`: indices of the runs in the file. `selected`: indices of these runs in `values`.
        """
        if self._name not in content.layout.variables:
            return
        stored = content.read(self._name)[rows]
        targets = [selected]
        for axis, (dim, positions) in enumerate(
            zip(self._dims, later_indices, strict=True), start=1
        ):
            # Index in the file of each requested label, -1 for a missing label.
            sources = content.indices(dim, self._labels[dim])[positions]
            is_stored = sources != NO_INDEX
            stored = stored.take(sources[is_stored], axis)
            targets.append(np.flatnonzero(is_stored))
            if dim == GENERATION:
                stored = self._mask_padding(
                    stored, axis, sources[is_stored], content.lengths.n_generations[rows]
                )
        values[np.ix_(*targets)] = stored

    def _mask_padding(
        self,
        stored: npt.NDArray[Any],
        axis: int,
        generations: Indices,
        n_generations: npt.NDArray[np.int32],
    ) -> npt.NDArray[Any]:
        """Replace the values after the last generation of each run by NaN.

        `stored`: [run, ...]. `generations`: the generations along `axis`.
        """
        is_padding = generations >= n_generations[:, None]  # [run, generation].
        if not is_padding.any():
            return stored
        shape = [1] * stored.ndim
        shape[0], shape[axis] = is_padding.shape
        return np.where(is_padding.reshape(shape), np.nan, stored.astype(self.dtype))


def _list_indices(key: tuple[Any, ...], shape: Sequence[int]) -> list[Indices]:
    return [np.atleast_1d(np.arange(size)[entry]) for entry, size in zip(key, shape, strict=True)]


def _orthogonal(key: tuple[Any, ...], shape: Sequence[int]) -> tuple[Any, ...]:
    """Return a key for NumPy that selects along each dimension independently."""
    if all(isinstance(entry, slice | int | np.integer) for entry in key):
        return key
    return np.ix_(*_list_indices(key, shape))


def _result_shape(key: tuple[Any, ...], shape: Sequence[int]) -> list[int]:
    """Return the shape of a selection. A dimension with a single integer is removed."""
    return [
        len(np.arange(size)[entry])
        for entry, size in zip(key, shape, strict=True)
        if not isinstance(entry, int | np.integer)
    ]
