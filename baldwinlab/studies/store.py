"""A study on disk: a directory with the experiments as TOML and one record per run.

    DIR/study.toml                              format, kind, seed, conditions and factors
    DIR/inputs/evo-A-generation-99-1a2b3c4d.nc  copy of a data file: see `study_file`
    DIR/parts/sense-poison.py                   source of a third-party part: see `study_file`
    DIR/runs/evo+self-taught/B/experiment.toml  all settings of a condition
    DIR/runs/evo+self-taught/B/0007.nc          record of a run: netCDF with a checksum
    DIR/runs/evo+self-taught/B/0000-0999.nc     records of many small runs
    DIR/sessions.jsonl                          time, speed and executor of each `run_study` session

Every file is written under a temporary name and then renamed. A reader therefore never sees a
partial file, several workers can write to one study, and an interrupted study lacks only its
unfinished runs. `study.toml` is written last and never overwritten. If several processes create
different studies in one directory, one of them succeeds. The directory can be in an object store or
at any other URL of fsspec (`files.parse_location`).
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from baldwinlab.core.deferred import xr
from baldwinlab.core.file_writing import (
    append_line,
    remove_abandoned,
    remove_file,
    require_appendable,
    require_writable_path,
    write_atomically,
)
from baldwinlab.core.files import (
    EXPERIMENT_FILE,
    SESSIONS_FILE,
    is_local,
    is_study,
    make_absolute,
    open_file,
    parse_json,
    quote_path,
    read_bytes,
    require_inside_study,
    shorten_path,
)
from baldwinlab.core.names import suggest
from baldwinlab.core.records import as_run, without_genomes
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.experiment.conditions import CONDITIONS, Factors
from baldwinlab.experiment.file import find_files
from baldwinlab.experiment.toml import from_toml
from baldwinlab.papers.worlds import name_maps
from baldwinlab.studies.progress import Amount, Count, remove_ended_processes
from baldwinlab.studies.record_files import (
    RecordFile,
    StudyError,
    assign_runs,
    condition_folder,
    find_record_file,
    list_record_files,
    list_stored_runs,
    record_path,
)
from baldwinlab.studies.records import (
    RunLengths,
    encode_record,
    read_attributes,
    read_lengths,
    read_record,
    read_record_of_file,
    write_in_study,
)
from baldwinlab.studies.study_file import (
    describe_changes,
    read_study_file,
    read_text_of_study,
    require_checksum,
    require_same_parts,
)

SESSIONS_FILE_NAME = "sessions.jsonl"
# Beginning of the hash of a data file in the text of an experiment.
HASH_PATTERN = re.compile('sha256"? = "[0-9a-f]')
# Error of a session that the user ended.
INTERRUPTED = "interrupted"


class _Session(BaseModel, extra="allow"):
    """A session in `sessions.jsonl`, with the fields that the package uses in computations."""

    seconds: Amount
    compile_seconds: Amount
    workers: Count
    agent_steps: Count
    runs: Count = 0


class StudyStore:
    """An open study directory. `studies.creation.create_study` creates a new one.

    - `directory`: the directory of the study, as an absolute path.
    - `content`: the content of `study.toml`, of which other attributes are parts.
    - `kind`: conditions, sweep or multiverse.
    - `experiments`, `factors`: experiment and factors of each condition, by name.
    - `parts`: third-party parts of the study.
    - `paper`: name of the reproduced paper, "" if the study has none.
    - `changes`: assignments that changed the model of the paper.
    """

    def __init__(self, directory: Path) -> None:
        """Open the study. Raises StudyError if the directory holds no readable study."""
        # An absolute path remains valid if the process changes its working directory.
        self.directory = make_absolute(directory)
        self.content = read_study_file(directory)
        self.kind = self.content.kind
        self.seed = self.content.seed
        self.first_run = self.content.first_run
        self.paper = self.content.paper
        self.changes = self.content.changes
        self.parts = self.content.parts
        names = self.content.conditions
        self.factors = {name: self.content.factors.get(name, Factors()) for name in names}
        self.experiments = {name: self._read_experiment(name) for name in names}
        # Points of a sweep have no factors, and the variants of a multiverse change the worlds.
        if self.kind == CONDITIONS:
            self.factors = name_maps(self.experiments, self.factors, self.paper)

    def _read_experiment(self, condition: str) -> Experiment:
        path = self.directory / "runs" / condition / "experiment.toml"
        try:
            text = read_text_of_study(path, EXPERIMENT_FILE)
            require_checksum(text)
            experiment = from_toml(text, source=str(path), lenient=True)
            if experiment.name != condition:
                raise ValueError(f"it belongs to the condition {experiment.name}")
            # Most experiments have no data file, and a study can have thousands of conditions.
            if HASH_PATTERN.search(text):
                find_files(experiment.to_dict(), [self.directory])
            return experiment
        except (OSError, ValueError, RecursionError) as error:
            raise StudyError(f"{path} cannot be read: {error}") from None

    @property
    def location(self) -> Path:
        """The directory in messages: relative to the working directory, if it is inside."""
        return shorten_path(self.directory)

    @property
    def changed_model(self) -> str:
        """A sentence for the report about the changes of the model; "" without changes."""
        return describe_changes(self.changes)

    def exists(self) -> bool:
        """Return whether the directory still holds the study."""
        return is_study(self.directory)

    def experiment(self, condition: str) -> Experiment:
        """Return the experiment of a condition. Raises StudyError for an unknown condition."""
        if condition not in self.experiments:
            suggestion = suggest(condition, self.experiments)
            raise StudyError(f"{self.location} has no condition {condition!r}{suggestion}")
        return self.experiments[condition]

    def require_parts(self, *conditions: str) -> None:
        """Check that the parts of conditions (by default of all) are loaded and unchanged."""
        require_same_parts(
            self.location, self.parts, map(self.experiment, conditions or self.experiments)
        )

    def path(self, condition: str, run: int) -> Path:
        """Return the path of the file that holds a run. See `find_record_file`."""
        return find_record_file(self.directory, condition, run).path

    def files(self, condition: str) -> list[RecordFile]:
        """Return the files of records, sorted by run. The files may be damaged."""
        files = list_record_files(condition_folder(self.directory, condition))
        return sorted(files, key=lambda file: (file.first, file.last))

    def runs(self, condition: str) -> list[int]:
        """Return the numbers of the stored runs. The files may be damaged."""
        return list_stored_runs(condition_folder(self.directory, condition))

    def lengths(self, condition: str, file: RecordFile) -> RunLengths:
        """Verify a file of records, and return the lengths of the runs. Raises as `record`."""
        return read_lengths(file, self.experiment(condition), self.seed)

    def require_runs(self, condition: str | None = None) -> None:
        """Raise StudyError if no run is stored yet, of a condition or of any."""
        conditions = self.experiments if condition is None else [condition]
        if not any(self.files(name) for name in conditions):
            of_condition = "" if condition is None else f" of {condition}"
            raise StudyError(
                f"{self.location} holds no finished run{of_condition} yet: `baldwinlab run "
                f"{quote_path(self.directory)} --runs 30` simulates 30 runs of each condition"
            )

    def write(self, condition: str, run: int, record: xr.Dataset) -> None:
        """Store the record of a run. Raises OSError, also if the study no longer exists."""
        path = record_path(self.directory, condition, run)
        write_in_study(self.directory, path, encode_record(record))

    def read(self, condition: str, run: int, *, genomes: bool = True) -> xr.Dataset:
        """Read one run.

        `genomes`: whether to include the genomes. Generations without stored genomes are filled
        with NaN, which takes memory.
        """
        record = self.record(condition, run)
        return as_run(record) if genomes else without_genomes(record)

    def record(self, condition: str, run: int) -> xr.Dataset:
        """Read one run in the stored form. Raises StudyError, also for a damaged file."""
        return read_record(self.directory, self.experiment(condition), self.seed, run)

    def records(self, condition: str) -> Iterator[tuple[int, xr.Dataset]]:
        """Yield the number and the record of each stored run."""
        experiment = self.experiment(condition)
        for file, runs in assign_runs(self.files(condition)):
            for run in runs:
                yield run, read_record_of_file(file, experiment, self.seed, run)

    def attributes(self, condition: str, run: int) -> dict[str, Any]:
        """Read the attributes of a record without its arrays. Raises as `record` does."""
        return read_attributes(self.directory, self.experiment(condition), self.seed, run)

    def rename_damaged(self, path: Path) -> Path:
        """Rename a damaged file to *.damaged and return the new path."""
        damaged = path.with_name(f"{path.name}.damaged")
        if is_local(path):
            require_inside_study(damaged)
            path.replace(damaged)
        else:
            # An object store cannot rename an object.
            with open_file(path) as file:
                write_atomically(damaged, file.read())
            remove_file(path)
        return damaged

    def sweep(self) -> None:
        """Remove the files of killed processes, and record files that are valid for no run."""
        for condition in self.experiments:
            for file, runs in assign_runs(self.files(condition)):
                if not runs:
                    remove_file(file.path)
        remove_ended_processes(self.directory)
        self.remove_abandoned_files()

    def remove_abandoned_files(self) -> None:
        """Remove the temporary files of killed processes."""
        if is_local(self.directory):
            remove_abandoned(self.directory)

    def require_writable(self, paths: Iterable[Path]) -> None:
        """Raise RefusedError if one of these files of the study cannot be written."""
        sessions = self.directory / SESSIONS_FILE_NAME
        require_appendable(sessions)
        for path in (*paths, sessions):
            require_writable_path(path)

    def add_session(self, session: dict[str, Any]) -> None:
        """Append a session to the sessions of the study."""
        append_line(self.directory / SESSIONS_FILE_NAME, json.dumps(session), SESSIONS_FILE)

    def sessions(self) -> Iterator[dict[str, Any]]:
        """Yield the stored sessions of the study.

        Invalid lines are skipped: a killed process can leave a partial line. Raises StudyError if
        the file cannot be read.
        """
        path = self.directory / SESSIONS_FILE_NAME
        try:
            content = read_bytes(path, SESSIONS_FILE) if path.exists() else b""
        except (OSError, ValueError) as error:
            raise StudyError(f"{path} cannot be read: {error}") from None
        for line in content.splitlines():
            with suppress(ValueError):
                yield _Session.model_validate(parse_json(line)).model_dump(exclude_unset=True)


def read_experiment(path: Path) -> BaseExperiment:
    """Return the experiment of a stored condition, or raise StudyError."""
    try:
        return from_toml(read_text_of_study(path, EXPERIMENT_FILE), source=str(path), lenient=True)
    except ValueError as error:
        raise StudyError(f"{path} cannot be read: {error}") from None
