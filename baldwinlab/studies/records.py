"""Records: files that contain one run each, with a checksum and their origin.

A record is a netCDF file (version 3) at runs/CONDITION/RUN.nc of a study. RUN is the number of the
run in at least four digits. The condition, seed, run and experiment in a record must match its path
and its study.
"""

from __future__ import annotations

import errno
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import xarray as xr

from baldwinlab.core.errors import BaldwinLabError
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.core.files import FileKind, is_local, read_bytes
from baldwinlab.core.netcdf import (
    DamagedError,
    decode_attributes,
    from_bytes,
    to_bytes,
    verify_checksum,
)
from baldwinlab.core.output_paths import is_study
from baldwinlab.core.variables import COMMON_RECORD_VARIABLES, RECORD_VARIABLES, as_record
from baldwinlab.experiment import BaseExperiment, ExperimentError
from baldwinlab.experiment.toml import from_toml
from baldwinlab.simulation.memory import record_bytes

# Upper bound of the numbers of runs, exclusive.
RUN_LIMIT: Final = 2**31
# Codes of the NumPy types of integers and floating-point numbers.
NUMERIC_KIND_CODES: Final = ("i", "f")
# Maximum size of names, meanings and the experiment in a record, in bytes.
MAX_HEADER_BYTES: Final = 4 * 2**20
# Maximum size of a record if its model is not loaded, in bytes.
# A netCDF variable has at most 2 GiB.
MAX_RECORD_BYTES: Final = 8 * 2**30


class StudyError(BaldwinLabError):
    """Invalid study: not a study, a different study, or not accessible."""


class DamagedRecordError(StudyError):
    """Damaged record: its content differs from its checksum."""


def encode_record(run: xr.Dataset) -> bytes:
    """Return the bytes of the record of a run."""
    return to_bytes(as_record(run))


def require_record_identity(
    attributes: Mapping[Any, Any], experiment: BaseExperiment, seed: int, run: int
) -> None:
    """Raise DamagedRecordError if a record is not of this run, experiment and seed.

    Parameters
    ----------
    attributes : mapping
        Attributes of the record.
    experiment : BaseExperiment
        The experiment of the condition.
    seed : int
        The seed of the study.
    run : int
        The number of the run.
    """
    condition = str(attributes.get("condition", ""))
    stored_seed = str(attributes.get("seed", ""))
    stored_run = str(attributes.get("run", ""))
    if (condition, stored_seed, stored_run) != (experiment.name, str(seed), str(run)):
        origin = "of no study"
        if condition:
            origin = f"run {stored_run} of {condition} with seed {stored_seed}"
        raise DamagedRecordError(
            f"it is {origin}, and run {run} of {experiment.name} with seed {seed} belongs there"
        )
    fields = _parse_fields(str(attributes.get("experiment", "")), type(experiment))
    if not _is_same_run(fields, experiment.to_dict()):
        raise DamagedRecordError(
            f"the experiment that it was made with is not that of {experiment.name} in this study"
        )


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


def require_content(record: xr.Dataset, experiment: BaseExperiment) -> None:
    """Raise DamagedRecordError if a record lacks variables, generations or agents.

    A record has the number of generations of the experiment in the record. After an extension of
    the study, it is less than the number of generations of the study.
    """
    fields = _parse_fields(str(record.attrs["experiment"]), type(experiment))
    n_generations = fields["evolution"]["generations"]
    n_agents = experiment.population.size
    has_variables = all(_is_declared(name, record) for name in COMMON_RECORD_VARIABLES)
    if not has_variables or record["energy"].shape != (n_generations, n_agents):
        raise DamagedRecordError(
            f"it does not contain the variables of {n_generations} generations of {n_agents} agents"
        )
    interval = experiment.record.genome_every
    expected_generations = [
        generation
        for generation in range(n_generations)
        if generation % interval == 0 or generation == n_generations - 1
    ]
    if record["kept_generation"].values.tolist() != expected_generations:
        raise DamagedRecordError(
            f"the generations of its genomes are not those of record.genome_every = {interval}"
        )


def _is_declared(name: str, record: xr.Dataset) -> bool:
    """Return whether a record has a numeric variable with its dimensions and coordinates."""
    variable = record.get(name)
    return (
        variable is not None
        and variable.dims == RECORD_VARIABLES[name].dims
        and variable.dtype.kind in NUMERIC_KIND_CODES
        and {*variable.dims} <= {*record.coords}
    )


@lru_cache(maxsize=64)
def _parse_fields(text: str, read_as: type[BaseExperiment]) -> dict[str, Any]:
    """Return the fields of the experiment of a record.

    The experiment is parsed once for all runs of a condition. Its class depends on the loaded
    parts, so `read_as`, the class of the study's experiment, is a part of the key of the cache.
    """
    return from_toml(text, source="its experiment", lenient=True).to_dict()


def read_record(directory: Path, experiment: BaseExperiment, seed: int, run: int) -> xr.Dataset:
    """Read the record of a run without opening its study.

    Parameters
    ----------
    directory : Path
        The directory of the study.
    experiment : BaseExperiment
        The experiment of the condition.
    seed : int
        The seed of the study.
    run : int
        The number of the run.

    Returns
    -------
    xarray.Dataset
        The variables of `baldwinlab.core.variables.RECORD_VARIABLES`.

    Raises
    ------
    DamagedRecordError
        If the file is damaged. The message contains its path.
    StudyError
        If the file does not exist or cannot be read.
    """
    return read_record_file(record_path(directory, experiment.name, run), experiment, seed, run)


def read_record_file(path: Path, experiment: BaseExperiment, seed: int, run: int) -> xr.Dataset:
    """Read a file with the format of a record, as `read_record` does."""
    with _read_bytes(path, experiment) as raw:
        record = from_bytes(raw)
        require_record_identity(record.attrs, experiment, seed, run)
        require_content(record, experiment)
    return record


def read_attributes(
    directory: Path, experiment: BaseExperiment, seed: int, run: int
) -> dict[str, Any]:
    """Read the attributes of a record without its arrays. Raises as `read_record` does."""
    with _read_bytes(record_path(directory, experiment.name, run), experiment) as raw:
        attributes = decode_attributes(raw)
        require_record_identity(attributes, experiment, seed, run)
    return attributes


def _max_record_bytes(experiment: BaseExperiment) -> int:
    """Return the maximum size of a record in bytes: twice its variables, and a header."""
    try:
        return 2 * record_bytes(experiment) + MAX_HEADER_BYTES
    except ExperimentError:
        # The model is not loaded.
        return MAX_RECORD_BYTES


@contextmanager
def _read_bytes(path: Path, experiment: BaseExperiment) -> Iterator[bytes]:
    """Yield the bytes of a record; errors inside the context contain its path."""
    kind = FileKind(f"a record of {experiment.name}", _max_record_bytes(experiment))
    try:
        try:
            raw = read_bytes(path, kind)
        except ValueError as error:
            raise DamagedRecordError(str(error)) from None
        verify_checksum(raw)
        yield raw
    except FileNotFoundError:
        n_stored_runs = len(list(stored_runs(path.parent)))
        raise StudyError(
            f"{path} does not exist; runs of {experiment.name} that are stored: {n_stored_runs}"
        ) from None
    except (DamagedError, DamagedRecordError) as error:
        raise DamagedRecordError(f"{path} is damaged: {error}") from None
    except OSError as error:
        raise StudyError(f"{path} cannot be read: {error.strerror or error}") from None


def stored_runs(folder: Path) -> Iterator[int]:
    """Yield the numbers of the records in the folder of a condition.

    Raises StudyError for a file that ends in .nc without the name of a record. Otherwise the file
    would be ignored, or confused with another run.
    """
    # The names of temporary files start with a dot.
    for entry in folder.glob("[!.]*.nc"):
        run = _parse_run_number(entry.stem)
        if run is None:
            raise StudyError(f"{entry} has no name of a record: remove it, or change its extension")
        if entry.name != record_name(run):
            raise StudyError(
                f"{entry} has no name of a record; run {run} is stored as "
                f"{record_name(run)}: remove it, or change its extension"
            )
        if is_local(entry) and not entry.is_file():
            raise StudyError(f"{entry} has the name of a record but is not a file: remove it")
        yield run


def _parse_run_number(text: str) -> int | None:
    """Return the number of a run, None if the text is not one."""
    max_digits = len(str(RUN_LIMIT))
    is_number = text.isascii() and text.isdecimal() and len(text) <= max_digits
    return int(text) if is_number and int(text) < RUN_LIMIT else None


def record_name(run: int) -> str:
    """Return the file name of the record of a run."""
    return f"{run:04d}.nc"


def record_path(directory: Path, condition: str, run: int) -> Path:
    """Return the file of the record of a run."""
    return directory / "runs" / condition / record_name(run)


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
