"""Content of a verified file of records, whose values are read when they are used."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.io import netcdf_file

from baldwinlab.core.deferred import pd, xr
from baldwinlab.core.files import is_local
from baldwinlab.core.netcdf import CHECKSUM_BYTES, decode_variables, from_bytes, stored_checksum
from baldwinlab.core.records import select_record, without_genomes
from baldwinlab.core.variables import PER_AGENT_DIMS
from baldwinlab.experiment import BaseExperiment
from baldwinlab.studies.record_checks import RunLengths, Variables, require_content
from baldwinlab.studies.record_files import RecordFile, StudyError
from baldwinlab.studies.records import read_verified

GENERATION: Final = PER_AGENT_DIMS[0]
NO_INDEX: Final = -1
# Dimensions whose labels can differ between the files of a condition.
_LABELED_DIMS: Final = ("agent", "parent", "window")

# Time of the last change in nanoseconds, and size in bytes.
Version = tuple[int, int]


class FileLayout(NamedTuple):
    """Properties of a record without genomes that many files share."""

    # Variables of a record without the generations, each with its type and attributes.
    variables: Mapping[Hashable, xr.Variable]
    labels: Mapping[Hashable, xr.Variable]  # Labels of the dimensions except the generations.


class FileContent(NamedTuple):
    """A verified file of records."""

    file: RecordFile
    experiment: BaseExperiment
    lengths: RunLengths
    layout: FileLayout  # Variables and labels of its records.
    checksum: str
    version: Version | None  # Version of the file when it was verified, None for a remote file.

    def read(self, name: Hashable) -> npt.NDArray[Any]:
        """Return the values of a variable, [run, ...], padded to the longest run."""
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
        return values if self.file.is_batch else values[None]

    def indices(self, dim: Hashable, labels: npt.NDArray[Any]) -> npt.NDArray[np.intp]:
        """Return the position in this file of each label of a dimension, -1 for none."""
        if dim == GENERATION:
            # The label of a generation is its number.
            is_stored = labels < self.lengths.n_generations.max()
            return np.where(is_stored, labels, NO_INDEX).astype(np.intp)
        own_labels = self.layout.labels[dim].values
        if np.array_equal(own_labels, labels):
            return np.arange(len(labels))
        indices: npt.NDArray[np.intp] = pd.Index(own_labels).get_indexer(pd.Index(labels))
        return indices


def read_version(path: Path) -> Version | None:
    """Return the version of a local file, None for a remote or missing one."""
    if not is_local(path):
        return None
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size


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
    """Verify a file of records, and return its content."""
    # The version is read first, so a later change is noticed.
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
    """Return what decides the layout: types, dimensions and labels."""
    types = tuple((name, variable.dims, variable.dtype) for name, variable in variables.items())
    labels = tuple(variables[dim].values.tobytes() for dim in _LABELED_DIMS if dim in variables)
    return types, labels


def _decode_layout(raw: bytes, file: RecordFile) -> FileLayout:
    data = from_bytes(raw)
    return make_layout(without_genomes(select_record(data, 0) if file.is_batch else data))


def make_layout(record: xr.Dataset) -> FileLayout:
    """Return the layout of a record without genomes."""
    labels = {name: record.variables[name] for name in record.coords if name != GENERATION}
    without_values = record.isel({GENERATION: slice(0)})
    variables = {name: without_values.variables[name].copy() for name in record.data_vars}
    return FileLayout(variables, labels)
