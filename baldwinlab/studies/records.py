"""Records: one run in one file, which carries a checksum of itself and says whose it is.

A record is netCDF (version 3). It lies at runs/CONDITION/RUN.nc of a study, the run's number in four digits or more, and is
believed only there: its own condition, seed, run and experiment must be those of its place.
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
from baldwinlab.core.files import FileKind, is_local, read_bytes, write_atomically
from baldwinlab.core.netcdf import DamagedError, attributes, from_bytes, to_bytes, verify
from baldwinlab.core.output_paths import is_study
from baldwinlab.core.variables import RECORD, to_storage
from baldwinlab.experiment import BaseExperiment, ExperimentError
from baldwinlab.experiment.toml import from_toml
from baldwinlab.simulation.memory import record_bytes

RUN_LIMIT: Final = 2**31  # a run's number is smaller
COMMON_VARIABLES: Final = ("energy", "parents", "kept_genome")  # what is recorded of every model
NUMBERS: Final = ("i", "f")  # kinds of NumPy
HEADER: Final = (
    4 * 2**20
)  # bytes of a record beside its variables: names, meanings and the experiment
MAX_HEADER: Final = (
    8 * 2**30
)  # bytes of a record of a model that is not here; netCDF holds 2 GiB of a variable


class StudyError(BaldwinLabError):
    """Invalid study: a directory that is no study, or another one, or cannot be accessed."""


class DamagedRecordError(StudyError):
    """Damaged record: its content differs from its checksum."""


def encode(run: xr.Dataset) -> bytes:
    """A run as it is stored."""
    return to_bytes(to_storage(run))


def require_record_identity(
    attributes: Mapping[Any, Any], experiment: BaseExperiment, seed: int, run: int
) -> None:
    """Raises DamagedRecordError where a record is not that of a run of this experiment, of a study with this seed."""
    own = {
        name: str(attributes.get(name, "")) for name in ("condition", "seed", "run", "experiment")
    }
    if (own["condition"], own["seed"], own["run"]) != (experiment.name, str(seed), str(run)):
        its = (
            f"run {own['run']} of {own['condition']} with seed {own['seed']}"
            if own["condition"]
            else "of no study"
        )
        raise DamagedRecordError(
            f"it is {its}, and run {run} of {experiment.name} with seed {seed} belongs there"
        )
    if _fields(own["experiment"], type(experiment)) != experiment.to_dict():
        raise DamagedRecordError(
            f"the experiment that it was made with is not that of {experiment.name} in this study"
        )


def require_content(record: xr.Dataset, experiment: BaseExperiment) -> None:
    """Raises DamagedRecordError where a record lacks what is recorded of every run of this experiment."""
    lived = (experiment.evolution.generations, experiment.population.size)
    if (
        not all(_is_declared(name, record) for name in COMMON_VARIABLES)
        or record["energy"].shape != lived
    ):
        raise DamagedRecordError(
            f"it does not hold what is recorded of {lived[0]} generations of {lived[1]} agents"
        )
    last, every = lived[0] - 1, experiment.record.genome_every
    kept = [
        generation
        for generation in range(lived[0])
        if generation % every == 0 or generation == last
    ]
    if record["kept_generation"].values.tolist() != kept:
        raise DamagedRecordError(
            f"the generations of its genomes are not those of record.genome_every = {every}"
        )


def _is_declared(name: str, record: xr.Dataset) -> bool:
    """Whether a variable is there as numbers, with its dimensions and their coordinates."""
    found = record.get(name)
    return (
        found is not None
        and found.dims == RECORD[name].dims
        and found.dtype.kind in NUMBERS
        and {*found.dims} <= {*record.coords}
    )


@lru_cache(maxsize=64)
def _fields(text: str, read_as: type[BaseExperiment]) -> dict[str, Any]:
    """A record's experiment, read once for a condition's runs, and again where the parts at hand make it another class."""
    return from_toml(text, where="its experiment", lenient=True).to_dict()


def read_record(directory: Path, experiment: BaseExperiment, seed: int, run: int) -> xr.Dataset:
    """The record of a run of the study in `directory`, whose seed it is; whoever reads need not have opened the study.

    Raises DamagedRecordError, naming the file, where it is not what was written, and StudyError where there is none.
    """
    with _read_bytes(directory, experiment, run) as raw:
        record = from_bytes(raw)
        require_record_identity(record.attrs, experiment, seed, run)
        require_content(record, experiment)
    return record


def read_attributes(
    directory: Path, experiment: BaseExperiment, seed: int, run: int
) -> dict[str, Any]:
    """What the record of a run says of itself, without decoding its arrays. Raises as `read_record` does."""
    with _read_bytes(directory, experiment, run) as raw:
        found = attributes(raw)
        require_record_identity(found, experiment, seed, run)
    return found


def _max_record_bytes(experiment: BaseExperiment) -> int:
    """Return the bytes that a record may have: twice what its variables take, and a header."""
    try:
        return 2 * record_bytes(experiment) + HEADER
    except ExperimentError:  # its model is not here
        return MAX_HEADER


@contextmanager
def _read_bytes(directory: Path, experiment: BaseExperiment, run: int) -> Iterator[bytes]:
    """Read a record as it was written. The message of an error in here names its file."""
    path = record_path(directory, experiment.name, run)
    kind = FileKind(f"a record of {experiment.name}", _max_record_bytes(experiment))
    try:
        try:
            raw = read_bytes(path, kind)
        except ValueError as error:
            raise DamagedRecordError(str(error)) from None
        verify(raw)
        yield raw
    except FileNotFoundError:
        count = len(list(stored_runs(path.parent)))
        raise StudyError(
            f"{path} does not exist; runs of {experiment.name} that are stored: {count}"
        ) from None
    except (DamagedError, DamagedRecordError) as error:
        raise DamagedRecordError(f"{path} is damaged: {error}") from None
    except OSError as error:
        raise StudyError(f"{path} cannot be read: {error.strerror or error}") from None


def stored_runs(folder: Path) -> Iterator[int]:
    """The runs whose records lie in a condition's folder, sound or not.

    Raises StudyError for what has the ending of a record, but cannot be one: it would be passed over, or taken for another.
    """
    for entry in folder.glob("[!.]*.nc"):  # a name with a dot is being written
        number = _parse_run_number(entry.stem)
        if number is None:
            raise StudyError(
                f"{entry} has no name of a record: remove it, or give it another ending"
            )
        if entry.name != record_name(number):
            right = f"run {number} is stored as {record_name(number)}"
            raise StudyError(
                f"{entry} has no name of a record; {right}: remove it, or give it another ending"
            )
        if is_local(entry) and not entry.is_file():
            raise StudyError(f"{entry} is no file, though it has the name of a record: remove it")
        yield number


def _parse_run_number(text: str) -> int | None:
    """A run's, where the text is one."""
    plain = text.isascii() and text.isdecimal() and len(text) <= len(str(RUN_LIMIT))
    return int(text) if plain and int(text) < RUN_LIMIT else None


def record_name(run: int) -> str:
    return f"{run:04d}.nc"


def record_path(directory: Path, condition: str, run: int) -> Path:
    return directory / "runs" / condition / record_name(run)


def write_record(directory: Path, condition: str, run: int, record: xr.Dataset) -> None:
    """Store a run of the study in `directory`; whoever writes need not have opened the study.

    Raises OSError, also where the study is there no longer: a record by itself would be lost.
    """
    write_in_study(directory, record_path(directory, condition, run), encode(record))


def write_in_study(directory: Path, path: Path, content: bytes) -> None:
    """Write a file of a study whole or not at all. Raises OSError as `write_record` does."""
    gone = FileNotFoundError(
        errno.ENOENT, "the study has been removed or moved while it ran", str(directory)
    )
    if not is_study(directory):
        raise gone
    try:
        write_atomically(path, content)
    except FileNotFoundError as error:
        raise error if is_study(directory) else gone from None
