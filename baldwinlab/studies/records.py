"""Records of runs: reading, verification and writing.

A file of records is a netCDF file (version 3) with a checksum. The file holds one run, or a batch
of runs (`core.records`). The condition, seed, runs and experiment in the file must match the path
of the file and the study.
"""

from __future__ import annotations

import errno
from collections.abc import Hashable, Iterator, Mapping
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

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
from baldwinlab.core.records import (
    KEPT_GENERATIONS,
    RUN_DIM,
    as_record,
    select_attributes,
    select_record,
)
from baldwinlab.core.variables import (
    COMMON_RECORD_VARIABLES,
    GENERATION_COUNT,
    RECORD_VARIABLES,
    STOP_ATTRIBUTE,
)
from baldwinlab.experiment import BaseExperiment, ExperimentError
from baldwinlab.experiment.toml import from_toml
from baldwinlab.simulation.memory import record_bytes
from baldwinlab.studies.record_files import RecordFile, find_record_file, list_stored_runs
from baldwinlab.studies.record_files import StudyError as StudyError

# Codes of the NumPy types of integers and floating-point numbers.
NUMERIC_KIND_CODES: Final = ("i", "f")

Variables = Mapping[Hashable, "xr.Variable"]
# Time of the last change of a file in nanoseconds, and its size in bytes.
Version = tuple[int, int]

# Maximum size of names, meanings and the experiment in a record, in bytes.
MAX_HEADER_BYTES: Final = 4 * 2**20
# Maximum size of a record in bytes if the model, and therefore the size, is not known. One netCDF
# variable has at most 2 GiB.
MAX_RECORD_BYTES: Final = 8 * 2**30
# Number of batches in the cache, because several threads can read runs of different batches.
N_CACHED_BATCHES: Final = 4


class DamagedRecordError(StudyError):
    """Damaged record: the content does not match the checksum, the file name or the study."""


class RunLengths(NamedTuple):
    """Lengths of the runs in a file of records."""

    n_generations: npt.NDArray[np.int32]
    is_stopped: npt.NDArray[np.bool_]  # Whether the stop part has ended the run.


def require_content(
    attributes: Mapping[Any, Any],
    variables: Variables,
    file: RecordFile,
    experiment: BaseExperiment,
    seed: int,
) -> RunLengths:
    """Check that the content of a file matches its name and the study. Return the run lengths."""
    fields = _require_origin(attributes, variables, file, experiment, seed)
    # A file that was written before an extension of the study has fewer generations.
    n_generations = fields["evolution"]["generations"]
    run_shape = (len(file.runs),) if file.is_batch else ()
    is_complete = all(
        _is_declared(name, variables, file.is_batch) for name in COMMON_RECORD_VARIABLES
    )
    shape = (*run_shape, n_generations, experiment.population.size)
    if not is_complete or variables["energy"].shape != shape:
        runs = f" of {len(file.runs)} runs" if file.is_batch else ""
        raise DamagedRecordError(
            f"it does not contain the variables of {n_generations} generations of "
            f"{experiment.population.size} agents{runs}"
        )
    if not file.is_batch:
        lengths = RunLengths(
            np.array([n_generations], np.int32), np.array([STOP_ATTRIBUTE in attributes])
        )
        kept_generations = variables["kept_generation"].values[None]
    else:
        lengths = _read_lengths(variables, n_generations)
        kept_generations = variables[KEPT_GENERATIONS].values
    _require_kept_generations(kept_generations, lengths.n_generations, experiment)
    return lengths


def _require_origin(
    attributes: Mapping[Any, Any],
    variables: Variables,
    file: RecordFile,
    experiment: BaseExperiment,
    seed: int,
) -> dict[str, Any]:
    """Check condition, seed, runs and experiment. Return the fields of the stored experiment."""
    condition = str(attributes.get("condition", ""))
    stored_seed = str(attributes.get("seed", ""))
    if file.is_batch:
        stored_runs = variables[RUN_DIM].values.tolist() if RUN_DIM in variables else []
        name = f"runs {stored_runs[0]} to {stored_runs[-1]}" if stored_runs else "no runs"
        is_same = stored_runs == list(file.runs)
    else:
        name = f"run {attributes.get('run', '')}"
        is_same = name == f"run {file.first}"
    if not is_same or (condition, stored_seed) != (experiment.name, str(seed)):
        origin = f"{name} of {condition} with seed {stored_seed}" if condition else "of no study"
        verb = "belong" if file.is_batch else "belongs"
        raise DamagedRecordError(
            f"it is {origin}, and {file} of {experiment.name} with seed {seed} {verb} there"
        )
    fields = parse_fields(str(attributes.get("experiment", "")), type(experiment))
    n_generations = fields["evolution"]["generations"]
    if n_generations > experiment.evolution.generations and _is_same_run(
        experiment.to_dict(), fields
    ):
        # The file is complete, so it must not be renamed or written again with fewer generations.
        raise StudyError(
            f"{file.path} has {n_generations} generations, and {experiment.name} has "
            f"{experiment.evolution.generations}: another process has extended the study, or the "
            "file belongs to an extended copy. Repeat the command, or remove the file."
        )
    if not _is_same_run(fields, experiment.to_dict()):
        raise DamagedRecordError(
            f"the experiment that it was made with is not that of {experiment.name} in this study"
        )
    return fields


def _is_same_run(fields: dict[str, Any], study_fields: dict[str, Any]) -> bool:
    """Return whether a record has the experiment of its study, possibly with fewer generations."""
    if fields == study_fields:
        return True
    generations = fields["evolution"]["generations"]
    study_evolution = study_fields["evolution"]
    if not 1 <= generations < study_evolution["generations"]:
        return False
    shortened_evolution = study_evolution | {"generations": generations}
    return fields == study_fields | {"evolution": shortened_evolution}


@lru_cache(maxsize=64)
def parse_fields(text: str, read_as: type[BaseExperiment]) -> dict[str, Any]:
    """Return the fields of the experiment of a record: {"evolution": {"generations": 100}, ...}.

    The cache parses the experiment once for all runs of a condition. `read_as` is the class of the
    study's experiment. It is only a key of the cache, because the class depends on loaded parts.
    """
    return from_toml(text, source="its experiment", lenient=True).to_dict()


def _is_declared(name: str, variables: Variables, is_batch: bool) -> bool:
    """Return whether a file has a numeric variable `name` with the declared dimensions."""
    variable = variables.get(name)
    dims = RECORD_VARIABLES[name].dims
    labeled_dims = {*variables}
    if is_batch:
        dims = (RUN_DIM, *dims)
        # A batch has no labels for this dimension, because the labels differ between the runs.
        labeled_dims.add("kept_generation")
    return (
        variable is not None
        and variable.dims == dims
        and variable.dtype.kind in NUMERIC_KIND_CODES
        and {*dims} <= labeled_dims
    )


def _read_lengths(variables: Variables, n_generations: int) -> RunLengths:
    """Return the lengths of the runs of a batch whose longest run has `n_generations`."""
    n_runs = variables["energy"].sizes[RUN_DIM]
    counts = variables.get(GENERATION_COUNT)
    kept_generations = variables.get(KEPT_GENERATIONS)
    if (
        counts is None
        or kept_generations is None
        or counts.shape != (n_runs,)
        or kept_generations.dims != (RUN_DIM, "kept_generation")
        or counts.values.min() < 1
        or counts.values.max() != n_generations
    ):
        raise DamagedRecordError("it does not contain the numbers of generations of its runs")
    is_stopped = np.zeros(n_runs, np.bool_)
    if STOP_ATTRIBUTE in variables:
        names = variables[STOP_ATTRIBUTE].values
        # The names are texts [run], or characters [run, character] if the file is not decoded.
        is_stopped = (names.astype(str) != "").reshape(n_runs, -1).any(axis=1)
    return RunLengths(counts.values.astype(np.int32), is_stopped)


def _require_kept_generations(
    kept_generations: npt.NDArray[Any],
    n_generations: npt.NDArray[np.int32],
    experiment: BaseExperiment,
) -> None:
    """Check that genomes of every `genome_every`-th and of the last generation are stored."""
    interval = experiment.record.genome_every
    for length in np.unique(n_generations).tolist():
        expected = [
            generation
            for generation in range(length)
            if generation % interval == 0 or generation == length - 1
        ]
        rows = kept_generations[n_generations == length]
        is_padding = rows[:, len(expected) :] == -1
        stored = rows[:, : len(expected)]
        if stored.tolist() != [expected] * len(stored) or not is_padding.all():
            raise DamagedRecordError(
                f"the generations of its genomes are not those of record.genome_every = {interval}"
            )


def encode_record(run: xr.Dataset) -> bytes:
    """Return the bytes of the record of a run."""
    return to_bytes(as_record(run))


def read_record(directory: Path, experiment: BaseExperiment, seed: int, run: int) -> xr.Dataset:
    """Read the record of a run without opening the study. Raises StudyError."""
    file = find_record_file(directory, experiment.name, run)
    return read_record_of_file(file, experiment, seed, run)


def read_record_of_file(
    file: RecordFile, experiment: BaseExperiment, seed: int, run: int
) -> xr.Dataset:
    """Read the record of a run from a known file, as `read_record` does."""
    if not file.is_batch:
        return _decode_file(file, experiment, seed)
    batch = _read_batch(file, experiment, seed)
    # A copy, because the caller must not change the arrays of the batch in the cache.
    return select_record(batch, run - file.first).copy(deep=True)


def read_record_file(path: Path, experiment: BaseExperiment, seed: int, run: int) -> xr.Dataset:
    """Read a file with one run, for example a checkpoint. Raises as `read_record` does."""
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
    """Verify a file of records, and return the lengths of the runs. Raises as `read_record`."""
    with read_verified(file, experiment) as raw:
        return require_content(*decode_variables(raw), file, experiment, seed)


def _read_batch(file: RecordFile, experiment: BaseExperiment, seed: int) -> xr.Dataset:
    """Return a batch of records. A local file is read again only if it has changed."""
    version = read_version(file.path)
    if version is None:
        return _decode_file(file, experiment, seed)
    return _read_cached_batch(file, experiment, seed, version)


def read_version(path: Path) -> Version | None:
    """Return the version of a local file, None for a remote or missing one."""
    if not is_local(path):
        return None
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size


@lru_cache(maxsize=N_CACHED_BATCHES)
def _read_cached_batch(
    file: RecordFile, experiment: BaseExperiment, seed: int, version: Version
) -> xr.Dataset:
    return _decode_file(file, experiment, seed)


def _decode_file(file: RecordFile, experiment: BaseExperiment, seed: int) -> xr.Dataset:
    """Read and verify a file of one run or of a batch."""
    with read_verified(file, experiment) as raw:
        data = from_bytes(raw)
        require_content(data.attrs, data.variables, file, experiment, seed)
    return data


@lru_cache(maxsize=64)
def _max_bytes_per_run(experiment: BaseExperiment) -> int:
    """Return the maximum size of a record in bytes: twice the size of its variables + header."""
    try:
        return 2 * record_bytes(experiment) + MAX_HEADER_BYTES
    except ExperimentError:
        # The model is not loaded.
        return MAX_RECORD_BYTES


@contextmanager
def read_verified(file: RecordFile, experiment: BaseExperiment) -> Iterator[bytes]:
    """Yield the bytes of a file of records after a check of the checksum.

    The context adds the path of the file to the errors that are raised inside it.
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


def write_in_study(directory: Path, path: Path, content: bytes | bytearray) -> None:
    """Write a file of a study atomically. Raises OSError, also if the study no longer exists."""
    removal_error = FileNotFoundError(
        errno.ENOENT, "the study has been removed or moved while it ran", str(directory)
    )
    if not is_study(directory):
        raise removal_error
    try:
        write_atomically(path, content)
    except FileNotFoundError as error:
        raise error if is_study(directory) else removal_error from None
