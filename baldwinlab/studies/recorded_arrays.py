"""Arrays of the stored runs of several conditions, which are read when their values are used."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from functools import cached_property
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt
from xarray.backends import BackendArray
from xarray.core import indexing

from baldwinlab.studies.file_content import GENERATION, NO_INDEX, FileContent

# A variable of at most this size is read as a whole, because its parts are often used repeatedly.
MAX_WHOLE_BYTES: Final = 256 * 2**20

Indices = npt.NDArray[np.intp]


class RunIndex(NamedTuple):
    """The files of the runs of a condition."""

    files: Sequence[FileContent]
    # Index of the file of each run of the dataset, -1 for a run that is not stored.
    file_of_run: Indices
    row_of_run: Indices


class RecordedArray(BackendArray):
    """A variable of the stored runs, [condition, run, ...].

    `dtype`: type of the values. It can hold NaN if a value is missing.
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
        """Return the values at the indices of each dimension. Missing values are NaN."""
        conditions, runs, *later_indices = indices
        values = np.zeros([len(positions) for positions in indices], self.dtype)
        if self.dtype.kind in "fO":
            values.fill(np.nan)
        for row, condition in enumerate(conditions):
            index = self._runs[condition]
            file_of_run = index.file_of_run[runs]
            # A search of the runs of each file would take time for each pair of file and run.
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
        """Copy the runs `rows` of a file into `values` at the positions `selected`."""
        if self._name not in content.layout.variables:
            return
        stored = content.read(self._name)[rows]
        targets = [selected]
        for axis, (dim, positions) in enumerate(
            zip(self._dims, later_indices, strict=True), start=1
        ):
            # Labels of the file at the requested positions.
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
        """Replace the generations after the end of each run by NaN."""
        is_padding = generations >= n_generations[:, None]
        if not is_padding.any():
            return stored
        shape = [1] * stored.ndim
        shape[0], shape[axis] = is_padding.shape
        return np.where(is_padding.reshape(shape), np.nan, stored.astype(self.dtype))


def _list_indices(key: tuple[Any, ...], shape: Sequence[int]) -> list[Indices]:
    return [np.atleast_1d(np.arange(size)[entry]) for entry, size in zip(key, shape, strict=True)]


def _orthogonal(key: tuple[Any, ...], shape: Sequence[int]) -> tuple[Any, ...]:
    """Return an index of NumPy that selects along each dimension independently."""
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
