"""Migration of a study: files of single small runs are merged into files of batches."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from itertools import groupby
from typing import Any, Final, NamedTuple

import numpy as np

from baldwinlab.core.deferred import xr
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.netcdf import decode_variables, to_bytes
from baldwinlab.core.record_batches import (
    KEPT_GENERATIONS,
    RUN_DIM,
    read_generations,
    replace_generations,
)
from baldwinlab.core.variables import GENERATION_COUNT, STOP_ATTRIBUTE
from baldwinlab.simulation.memory import MAX_BYTES_PER_FILE, MIN_RUNS_PER_BATCH, runs_per_file
from baldwinlab.simulation.records import NO_GENERATION, stack_padded
from baldwinlab.studies.claims_file import read_claims, write_claims
from baldwinlab.studies.record_checks import DamagedRecordError, require_content
from baldwinlab.studies.record_files import RecordFile, StudyError, condition_folder, record_name
from baldwinlab.studies.records import read_record_of_file, read_verified, write_in_study
from baldwinlab.studies.store import StudyStore

# Number of runs of the smallest batch, between damaged files or records of other versions.
MIN_MERGED_RUNS: Final = 2
# Dimensions in which the runs of a batch can differ.
_RAGGED_DIMS: Final = ("generation", "kept_generation")


class Migration(NamedTuple):
    """Result of a migration.

    Attributes
    ----------
    n_merged : int
        Number of files of single runs that are now in batches.
    n_batches : int
        Number of files of these batches.
    n_files : int
        Number of files of records of the study.
    """

    n_merged: int
    n_batches: int
    n_files: int


class RawRecord(NamedTuple):
    """The attributes and the variables of the record of one run, as its file stores them."""

    attributes: dict[str, Any]
    variables: Mapping[Hashable, xr.Variable]

    @property
    def run(self) -> int:
        """Number of the run."""
        return int(self.attributes[RUN_DIM])

    @property
    def n_generations(self) -> int:
        """Number of generations of the run."""
        return self.variables["energy"].sizes["generation"]


def migrate_study(
    study: StudyStore, log: Callable[[str], None], *, is_dry_run: bool = False
) -> Migration:
    """Merge the files of single small runs into files of batches.

    The records do not change. A file of a single run is removed after its record has been read
    from the file of the batch. An interrupted migration is continued by the next one.

    Parameters
    ----------
    study : StudyStore
        The study.
    log : callable
        Called with a message for each damaged file, which is not merged.
    is_dry_run : bool
        Whether nothing is written. Files that cannot be merged are then counted as merged.

    Raises
    ------
    ExperimentError
        A custom part is not loaded.
    OSError
        A file cannot be written or removed.
    """
    try:
        claims = read_claims(study)
    except StudyError:
        claims = []
    n_merged = n_batches = 0
    for condition in study.experiments:
        for group in _plan_batches(study, condition, is_dry_run):
            batches = [group] if is_dry_run else _merge(study, condition, group, log)
            n_batches += len(batches)
            n_merged += sum(map(len, batches))
    if claims and n_merged and not is_dry_run:
        # The verdicts have a digest of the files that decided them.
        write_claims(study, claims)
    n_files = sum(len(study.files(condition)) for condition in study.experiments)
    if is_dry_run:
        n_files -= n_merged - n_batches
    return Migration(n_merged, n_batches, n_files)


def _plan_batches(
    study: StudyStore, condition: str, is_dry_run: bool
) -> Iterator[list[RecordFile]]:
    """Yield the files of single runs that one batch can hold."""
    size = runs_per_file(study.experiments[condition])
    if size == 1:
        return
    files = study.files(condition)
    runs_in_batches = {run for file in files if file.is_batch for run in file.runs}
    singles = []
    for file in files:
        if file.is_batch:
            continue
        if file.first not in runs_in_batches:
            singles.append(file)
        elif not is_dry_run:
            _remove_copy(study, condition, file)
    # Consecutive runs have the same difference between their number and their index.
    for _, group in groupby(enumerate(singles), lambda entry: entry[1].first - entry[0]):
        consecutive = [file for _, file in group]
        # The arrays of the runs can be larger than the variables.
        max_bytes = max(file.path.stat().st_size for file in consecutive)
        n_runs = min(size, max(1, MAX_BYTES_PER_FILE // max_bytes))
        for start in range(0, len(consecutive), n_runs):
            batch = consecutive[start : start + n_runs]
            if len(batch) >= MIN_RUNS_PER_BATCH:
                yield batch


def _remove_copy(study: StudyStore, condition: str, file: RecordFile) -> None:
    """Remove the file of a run that an interrupted migration has copied into a batch."""
    batches = (entry for entry in study.files(condition) if entry.is_batch)
    batch = next(entry for entry in batches if file.first in entry.runs)
    try:
        copy = read_record_of_file(batch, study.experiments[condition], study.seed, file.first)
        is_copy = copy.identical(study.record(condition, file.first))
    except DamagedRecordError:
        return
    if is_copy:
        file.path.unlink(missing_ok=True)


def _merge(
    study: StudyStore, condition: str, files: Sequence[RecordFile], log: Callable[[str], None]
) -> list[list[RecordFile]]:
    """Merge files into as few batches as possible, and return the files of each batch."""
    records: dict[RecordFile, RawRecord | None] = {}
    for file in files:
        try:
            records[file] = _read_raw(study, condition, file)
        except DamagedRecordError as error:
            log(f"{error}; it is not merged")
            records[file] = None
    batches = []
    for _, group in groupby(files, lambda file: _batch_key(records[file])):
        similar = list(group)
        similar_records = [record for file in similar if (record := records[file]) is not None]
        # A damaged record has the key None.
        if len(similar_records) < MIN_MERGED_RUNS:
            continue
        _write_batch(study, condition, similar_records)
        for file in similar:
            file.path.unlink(missing_ok=True)
        batches.append(similar)
    return batches


def _read_raw(study: StudyStore, condition: str, file: RecordFile) -> RawRecord:
    """Read and verify a file without the decoding of xarray, which takes 20 times as long."""
    experiment = study.experiments[condition]
    with read_verified(file, experiment) as raw:
        record = RawRecord(*decode_variables(raw))
        require_content(*record, file, experiment, study.seed)
    return record


def _batch_key(record: RawRecord | None) -> Hashable:
    """Return what the records of a batch have in common; None for a damaged record."""
    if record is None:
        return None
    attributes = {
        name: value
        for name, value in record.attributes.items()
        if name not in (RUN_DIM, STOP_ATTRIBUTE)
    }
    experiment = attributes["experiment"]
    attributes["experiment"] = replace_generations(experiment, 0)
    # Another line than the number of generations would be replaced in the text.
    is_replaceable = read_generations(experiment) == record.n_generations
    # The order of the variables in a file depends on the number of generations.
    variables = sorted(
        (
            str(name),
            variable.dims,
            str(variable.dtype),
            tuple(size for dim, size in variable.sizes.items() if dim not in _RAGGED_DIMS),
            str(variable.attrs),
        )
        for name, variable in record.variables.items()
    )
    labels = tuple(
        variable.values.tobytes()
        for name, variable in sorted(record.variables.items())
        if name in variable.dims and name not in _RAGGED_DIMS
    )
    # A netCDF dimension of size 0 can only be the first one.
    has_empty_array = any(0 in variable.shape for variable in record.variables.values())
    unique = record.run if has_empty_array or not is_replaceable else None
    return unique, str(attributes), tuple(variables), labels


def _write_batch(study: StudyStore, condition: str, records: Sequence[RawRecord]) -> None:
    """Write a batch, and check that its file has the values of the records."""
    first, last = records[0].run, records[-1].run
    folder = condition_folder(study.directory, condition)
    file = RecordFile(folder / record_name(first, last), first, last)
    longest = max(records, key=lambda record: record.n_generations)
    template = study.record(condition, longest.run)
    batch = stack_records(records, template)
    write_in_study(study.directory, file.path, to_bytes(batch))
    experiment = study.experiments[condition]
    stored = _read_raw(study, condition, file)
    has_equal_values = all(
        stored.variables[name].values.astype(variable.dtype).tobytes() == variable.values.tobytes()
        for name, variable in batch.data_vars.items()
        if name != STOP_ATTRIBUTE
    )
    copy = read_record_of_file(file, experiment, study.seed, longest.run)
    if not (has_equal_values and copy.identical(template)):
        file.path.unlink()
        raise RefusedError(
            f"runs {first} to {last} of {condition} cannot be merged: their records change"
        )


def stack_records(records: Sequence[RawRecord], template: xr.Dataset) -> xr.Dataset:
    """Return records as a batch, which `select_record` reads.

    Parameters
    ----------
    records : sequence of RawRecord
        Records of consecutive runs with equal keys.
    template : xarray.Dataset
        The decoded record of the longest run.
    """
    data: dict[Hashable, Any] = {}
    for name, variable in template.data_vars.items():
        arrays = [record.variables[name].values for record in records]
        values = stack_padded(arrays, fill=0).astype(variable.dtype)
        data[name] = ((RUN_DIM, *variable.dims), values, variable.attrs)
    counts = [record.n_generations for record in records]
    data[GENERATION_COUNT] = (RUN_DIM, np.array(counts, np.int32), {})
    saved = [record.variables["kept_generation"].values for record in records]
    kept_generations = stack_padded(saved, fill=NO_GENERATION).astype(np.int32)
    data[KEPT_GENERATIONS] = ((RUN_DIM, "kept_generation"), kept_generations, {})
    stops = [record.attributes.get(STOP_ATTRIBUTE, "") for record in records]
    if any(stops):
        data[STOP_ATTRIBUTE] = (RUN_DIM, stops, {})
    coordinates = {
        name: values.variable for name, values in template.coords.items() if name != _RAGGED_DIMS[1]
    }
    coordinates[RUN_DIM] = np.array([record.run for record in records], np.int32)
    excluded = (RUN_DIM, STOP_ATTRIBUTE)
    attributes = {name: value for name, value in template.attrs.items() if name not in excluded}
    return xr.Dataset(data, coordinates, attributes).drop_encoding()
