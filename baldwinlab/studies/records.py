"""Records of runs: reading, verification and writing of the files of a study.

A file of records is a netCDF file (version 3) with a checksum. It holds one run, or a batch of runs
(`core.records`). The condition, seed, runs and experiment in a file must match its path and
its study.
"""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

from baldwinlab.core.deferred import xr
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.core.files import FileKind, is_local, is_study, read_bytes
from baldwinlab.core.netcdf import (
    DamagedError,
    decode_variables,
    from_bytes,
    to_bytes,
    verify_checksum,
)
from baldwinlab.core.records import as_record, select_attributes, select_record
from baldwinlab.experiment import BaseExperiment, ExperimentError
from baldwinlab.simulation.memory import record_bytes
from baldwinlab.studies.record_checks import DamagedRecordError, RunLengths, require_content
from baldwinlab.studies.record_files import (
    RecordFile,
    StudyError,
    find_record_file,
    list_stored_runs,
    record_path,
)

__all__ = [
    "DamagedRecordError",
    "StudyError",
    "encode_record",
    "read_attributes",
    "read_lengths",
    "read_record",
    "read_record_file",
    "read_record_of_file",
    "record_path",
    "write_in_study",
    "write_record",
]

# Maximum size of names, meanings and the experiment in a record, in bytes.
MAX_HEADER_BYTES: Final = 4 * 2**20
# Maximum size of a record if its model is not loaded, in bytes.
# A netCDF variable has at most 2 GiB.
MAX_RECORD_BYTES: Final = 8 * 2**30
# Number of batches in memory. Several threads can read the runs of different batches.
N_CACHED_BATCHES: Final = 4


def encode_record(run: xr.Dataset) -> bytes:
    """Return the bytes of the record of a run."""
    return to_bytes(as_record(run))


def read_record(directory: Path, experiment: BaseExperiment, seed: int, run: int) -> xr.Dataset:
    """Read the record of a run without opening its study."""
    file = find_record_file(directory, experiment.name, run)
    return read_record_of_file(file, experiment, seed, run)


def read_record_of_file(
    file: RecordFile, experiment: BaseExperiment, seed: int, run: int
) -> xr.Dataset:
    """Read the record of a run from the file that holds it, as `read_record` does."""
    if not file.is_batch:
        return _decode_file(file, experiment, seed)
    batch = _read_batch(file, experiment, seed)
    # The batch is in a cache, so its arrays must not be changed.
    return select_record(batch, run - file.first).copy(deep=True)


def read_record_file(path: Path, experiment: BaseExperiment, seed: int, run: int) -> xr.Dataset:
    """Read a file with the format of the record of one run, as `read_record` does."""
    return _decode_file(RecordFile(path, run, run), experiment, seed)


def read_attributes(
    directory: Path, experiment: BaseExperiment, seed: int, run: int
) -> dict[str, Any]:
    """Read the attributes of the record of a run. Raises as `read_record` does."""
    file = find_record_file(directory, experiment.name, run)
    if file.is_batch:
        return select_attributes(_read_batch(file, experiment, seed), run - file.first)
    with read_verified(file, experiment) as raw:
        attributes, variables = decode_variables(raw)
        require_content(attributes, variables, file, experiment, seed)
    return attributes


def read_lengths(file: RecordFile, experiment: BaseExperiment, seed: int) -> RunLengths:
    """Verify a file of records, and return the lengths of its runs. Raises as `read_record`."""
    with read_verified(file, experiment) as raw:
        return require_content(*decode_variables(raw), file, experiment, seed)


def _read_batch(file: RecordFile, experiment: BaseExperiment, seed: int) -> xr.Dataset:
    """Return a batch of records. A local file is read again only if it has changed."""
    if not is_local(file.path):
        return _decode_file(file, experiment, seed)
    try:
        status = file.path.stat()
    except OSError as error:
        raise StudyError(f"{file.path} cannot be read: {error.strerror or error}") from None
    version = (status.st_mtime_ns, status.st_size)
    return _read_cached_batch(file, experiment, seed, version)


@lru_cache(maxsize=N_CACHED_BATCHES)
def _read_cached_batch(
    file: RecordFile, experiment: BaseExperiment, seed: int, version: tuple[int, int]
) -> xr.Dataset:
    return _decode_file(file, experiment, seed)


def _decode_file(file: RecordFile, experiment: BaseExperiment, seed: int) -> xr.Dataset:
    """Read and verify a file of one run or of a batch."""
    with read_verified(file, experiment) as raw:
        data = from_bytes(raw)
        require_content(data.attrs, data.variables, file, experiment, seed)
    return data


@lru_cache(maxsize=64)
def _variable_bytes(experiment: BaseExperiment) -> int:
    return record_bytes(experiment)


def _max_bytes_per_run(experiment: BaseExperiment) -> int:
    """Return the maximum size of a record in bytes: twice its variables, and a header."""
    try:
        return 2 * _variable_bytes(experiment) + MAX_HEADER_BYTES
    except ExperimentError:
        # The model is not loaded.
        return MAX_RECORD_BYTES


@contextmanager
def read_verified(file: RecordFile, experiment: BaseExperiment) -> Iterator[bytes]:
    """Yield the bytes of a file of records after a check of its checksum.

    Errors inside the context contain the path.
    """
    path = file.path
    max_bytes = len(file.runs) * _max_bytes_per_run(experiment)
    kind = FileKind(f"a record of {experiment.name}", max_bytes)
    try:
        try:
            raw = read_bytes(path, kind)
        except ValueError as error:
            raise DamagedRecordError(str(error)) from None
        verify_checksum(raw)
        yield raw
    except FileNotFoundError:
        n_stored_runs = len(list_stored_runs(path.parent))
        raise StudyError(
            f"{path} does not exist; runs of {experiment.name} that are stored: {n_stored_runs}"
        ) from None
    except (DamagedError, DamagedRecordError) as error:
        raise DamagedRecordError(f"{path} is damaged: {error}") from None
    except OSError as error:
        raise StudyError(f"{path} cannot be read: {error.strerror or error}") from None


def write_record(directory: Path, condition: str, run: int, record: xr.Dataset) -> None:
    """Store the record of a run without opening its study.

    Raises OSError, also if the study no longer exists.
    """
    write_in_study(directory, record_path(directory, condition, run), encode_record(record))


def write_in_study(directory: Path, path: Path, content: bytes) -> None:
    """Write a file of a study atomically. Raises OSError as `write_record` does."""
    removal_error = FileNotFoundError(
        errno.ENOENT, "the study has been removed or moved while it ran", str(directory)
    )
    if not is_study(directory):
        raise removal_error
    try:
        write_atomically(path, content)
    except FileNotFoundError as error:
        raise error if is_study(directory) else removal_error from None
