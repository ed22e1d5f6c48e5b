"""A study on disk: a directory with the experiments as TOML and one record a run.

    DIR/study.toml                              format, kind, seed, conditions, their factors
    DIR/parts/sense-poison.py                   the source of a foreign part, kept and never executed: see `trust`
    DIR/runs/evo+self-taught/B/experiment.toml  the condition, whole
    DIR/runs/evo+self-taught/B/0007.nc          one run: netCDF, which carries a checksum of itself
    DIR/sessions.jsonl                          when it was worked on, how fast, with what

A file appears whole or not at all: it is written under another name and then renamed. So any number
of workers may write to one study, and a study that was interrupted lacks its unfinished runs and
nothing else. `study.toml` is written last, and only where there is none, so that of several
processes that create different studies in one directory, one succeeds. The directory may lie in an
object store, or wherever fsspec reaches (`files.parse_location`). Format 1, which had no kind and no
factors, and format 2, without seals, can be read.
"""

from __future__ import annotations

import json
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import xarray as xr

from baldwinlab.core.errors import RefusedError
from baldwinlab.core.files import (
    EXPERIMENT_FILE,
    PARTIAL,
    SESSIONS_FILE,
    STUDY,
    STUDY_FILE,
    append_line,
    is_local,
    parse_toml,
    read_bytes,
    require_inside_study,
    require_writable_path,
    write_atomically,
    write_exclusively,
)
from baldwinlab.core.output_paths import is_study, owner
from baldwinlab.core.suggestions import suggest
from baldwinlab.core.variables import from_storage
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.experiment.factors import CONDITIONS, Factors, Kind
from baldwinlab.experiment.file import require_files
from baldwinlab.experiment.toml import from_toml, to_toml
from baldwinlab.studies import part_sources
from baldwinlab.studies.records import (
    StudyError,
    read_attributes,
    read_record,
    record_path,
    stored_runs,
    write_record,
)
from baldwinlab.studies.study_file import (
    add_checksum,
    describe_changes,
    format_study,
    kind_and_factors,
    read_changes,
    read_text_of_study,
    require_checksum,
    require_valid_contents,
)

if TYPE_CHECKING:
    from baldwinlab.parts.loading import Source

SESSIONS = "sessions.jsonl"
SESSION_NUMBERS = (
    "seconds",
    "compile_seconds",
    "workers",
    "agent_steps",
)  # the numbers that a session has


class StudyStore:
    """An existing study directory. Make one with `create`, open one with `StudyStore(directory)`."""

    def __init__(self, directory: Path) -> None:
        """Raises StudyError if the directory holds no study that can be read."""
        self.directory = directory
        path = directory / STUDY
        try:
            text = read_text_of_study(path, STUDY_FILE)
            facts = parse_toml(text)
            self.seed: int = facts["seed"]
            names: list[str] = facts["conditions"]
            require_valid_contents(self.seed, names)
            self.kind, self.factors = kind_and_factors(facts, directory)
            self.format: int = facts["format"]
            require_checksum(text, self.format)
            self.parts = part_sources.read_part_records(facts)  # the foreign ones
            self.paper: str = facts.get("paper", "")  # that made it; "" where none did
            self.changes = read_changes(facts)  # of the paper's model
        except FileNotFoundError:
            raise StudyError(f"{directory} holds no study: it has no study.toml") from None
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise StudyError(f"{path} cannot be read: {error}") from None
        self.experiments = {name: self._experiment(name) for name in names}

    def _experiment(self, condition: str) -> Experiment:
        path = self.directory / "runs" / condition / "experiment.toml"
        try:
            text = read_text_of_study(path, EXPERIMENT_FILE)
            require_checksum(text, self.format)
            experiment = from_toml(text, where=str(path), lenient=True)
            if experiment.name != condition:
                raise ValueError(f"it is that of the condition {experiment.name}")
            return experiment
        except (OSError, ValueError, RecursionError) as error:
            raise StudyError(f"{path} cannot be read: {error}") from None

    @property
    def changed_model(self) -> str:
        """The sentence that marks a study of a changed model wherever its results are shown; "" for any other."""
        return describe_changes(self.changes)

    def exists(self) -> bool:
        """Whether it is still there: it may have been removed or moved since it was opened."""
        return is_study(self.directory)

    def experiment(self, condition: str) -> Experiment:
        """Raises StudyError for a condition that the study has not."""
        if condition not in self.experiments:
            known = suggest(condition, self.experiments)
            raise StudyError(f"{self.directory} has no condition {condition!r}{known}")
        return self.experiments[condition]

    def require_parts(self, *conditions: str) -> None:
        """Raises PartError where these conditions (or all, unless any is given) choose a part that is not here, or is another."""
        part_sources.require_same_parts(
            self.directory, self.parts, map(self.experiment, conditions or self.experiments)
        )

    def path(self, condition: str, run: int) -> Path:
        return record_path(self.directory, condition, run)

    def runs(self, condition: str) -> list[int]:
        """The runs that are stored, sound or not."""
        return sorted(stored_runs(self.directory / "runs" / condition))

    def require_runs(self) -> None:
        """Raises StudyError where no run is stored yet."""
        if not any(self.runs(condition) for condition in self.experiments):
            raise StudyError(
                f"{self.directory} holds no finished run yet; the command that made it carries on"
            )

    def write(self, condition: str, run: int, record: xr.Dataset) -> None:
        write_record(self.directory, condition, run, record)

    def read(self, condition: str, run: int, *, genomes: bool = True) -> xr.Dataset:
        """One run, whole; without genomes where those that are not kept would fill memory with NaN. Raises as `record` does."""
        record = self.record(condition, run)
        return (
            from_storage(record)
            if genomes
            else record.drop_dims("kept_generation").drop_vars(["module", "weight"])
        )

    def record(self, condition: str, run: int) -> xr.Dataset:
        """One run as it is stored. Raises DamagedRecordError, naming the file, and StudyError where there is none."""
        return read_record(self.directory, self.experiment(condition), self.seed, run)

    def attributes(self, condition: str, run: int) -> dict[str, Any]:
        """What the record of one run says of itself, its arrays not read. Raises as `record` does."""
        return read_attributes(self.directory, self.experiment(condition), self.seed, run)

    def set_aside(self, condition: str, run: int) -> Path:
        """Move a damaged record out of the way, keeping it."""
        path = self.path(condition, run)
        aside = path.with_name(f"{path.name}.damaged")
        if is_local(path):
            require_inside_study(aside)
            path.replace(aside)
        else:
            write_atomically(aside, path.read_bytes())  # an object cannot be renamed
            path.unlink()
        return aside

    def sweep(self) -> None:
        """Remove what killed writers left. A writer at work needs its file for moments only, so anything older than a minute."""
        for leftover in self.directory.rglob(f".*{PARTIAL}") if is_local(self.directory) else ():
            if time.time() - leftover.stat().st_mtime > 60:
                leftover.unlink(missing_ok=True)

    def require_writable(self, paths: Iterable[Path]) -> None:
        """Raise RefusedError, naming the file, where one of these files of the study could not be written."""
        sessions = self.directory / SESSIONS
        if is_local(sessions) and sessions.is_symlink():
            raise RefusedError(f"{sessions} cannot be written: it is a link; remove it")
        for path in (*paths, sessions):
            require_writable_path(path)

    def add_session(self, facts: dict[str, Any]) -> None:
        append_line(self.directory / SESSIONS, json.dumps(facts), SESSIONS_FILE)

    def sessions(self) -> Iterator[dict[str, Any]]:
        """Read the sessions in which the study was worked on.

        A line that is no session, such as one torn by a kill, is passed over. Raises StudyError for
        a file that cannot be read.
        """
        path = self.directory / SESSIONS
        try:
            content = read_bytes(path, SESSIONS_FILE) if path.exists() else b""
        except (OSError, ValueError) as error:
            raise StudyError(f"{path} cannot be read: {error}") from None
        for line in content.splitlines():
            try:
                session = json.loads(line)
            except (ValueError, RecursionError):
                continue
            if isinstance(session, dict) and all(
                isinstance(session.get(name), int | float) for name in SESSION_NUMBERS
            ):
                yield session


def create(
    directory: Path,
    experiments: Sequence[Experiment],
    seed: int,
    kind: Kind = CONDITIONS,
    factors: Mapping[str, Factors] = MappingProxyType({}),
    paper: str = "",
    changes: Sequence[str] = (),
) -> StudyStore:
    """Make a study, or open the one that is there if it is the same.

    `factors` are those of the conditions by name; a condition without a learner is its own, but for the points of a sweep.
    `paper` is the name of the one that it is made by, if any, and `changes` are the assignments that changed its model.
    Raises StudyError if the directory holds another study or anything else: it is never mixed, never overwritten.
    """
    names = [experiment.name for experiment in experiments]
    if len(set(names)) < len(names):
        name = next(name for name in names if names.count(name) > 1)
        raise StudyError(f"two conditions have the same name, {name!r}: change name in one of them")
    for name in names:
        if any(part.endswith((".nc", ".toml", ".damaged")) for part in name.split("/")):
            raise StudyError(
                f"no condition can be called {name!r}: a study has files with such endings"
            )
    if is_local(directory) and (folder := owner(directory)):
        raise StudyError(f"{directory} is inside the study {folder}. Choose another path.")
    is_new = False
    if not is_study(directory):
        sources = part_sources.collect_sources(experiments)
        for experiment in experiments:
            require_files(experiment, "")
        text = add_checksum(format_study(names, seed, kind, factors, paper, changes, sources))
        try:
            is_new = _write_study(directory, experiments, sources, text)
        except OSError as error:
            raise StudyError(
                f"{error.filename or directory} cannot be written: {error.strerror or error}"
            ) from None
    study = StudyStore(directory)
    if not is_new:
        study.require_parts()
        _require_same(study, experiments, seed, paper)
    return study


def _write_study(
    directory: Path, experiments: Sequence[Experiment], sources: Sequence[Source], text: str
) -> bool:
    """Write the files of a new study, `study.toml` last. False where another process has been faster."""
    entries = list(directory.iterdir()) if directory.exists() else []
    if not all(map(_is_study_entry, entries)) and not is_study(directory):
        raise StudyError(f"{directory} is not empty and holds no study; choose another --out")
    for experiment in sorted(
        experiments, key=lambda one: one.name
    ):  # in one order in all processes
        _write_experiment(directory, experiment)
    part_sources.save_sources(directory, sources)
    try:
        write_exclusively(directory / STUDY, text.encode())
    except FileExistsError:
        return False
    return True


def _write_experiment(directory: Path, experiment: BaseExperiment) -> None:
    """Write a condition of a study that is being created. Raises StudyError where another lies there."""
    path = directory / "runs" / experiment.name / "experiment.toml"
    require_inside_study(path, directory)
    try:
        write_exclusively(path, add_checksum(to_toml(experiment)).encode())
    except FileExistsError:
        if _read_experiment(path) != experiment:
            raise StudyError(
                f"{directory} holds the beginning of another study; choose another --out"
            ) from None


def _read_experiment(path: Path) -> BaseExperiment:
    try:
        return from_toml(read_text_of_study(path, EXPERIMENT_FILE), str(path), lenient=True)
    except ValueError as error:
        raise StudyError(f"{path} cannot be read: {error}") from None


def _is_study_entry(entry: Path) -> bool:
    """Whether it is the runs or parts of a study that is being created, or a study below it, such as a multiverse."""
    return (
        entry.name in ("runs", "parts") or entry.name.endswith(PARTIAL) or (entry / "runs").is_dir()
    )


def _require_same(
    study: StudyStore, experiments: Sequence[Experiment], seed: int, paper: str
) -> None:
    where = f"{study.directory} holds another study"
    if study.seed != seed:
        raise StudyError(f"{where}: its seed is {study.seed}, not {seed}; choose another --out")
    if paper and study.paper not in (paper, ""):
        raise StudyError(
            f"{where}: it is of the paper {study.paper}, not {paper}; choose another --out"
        )
    names = [experiment.name for experiment in experiments]
    if list(study.experiments) != names:
        raise StudyError(
            f"{where}: its conditions are {_list_briefly(list(study.experiments))}, not {_list_briefly(names)}; choose another --out"
        )
    for experiment in experiments:
        stored = study.experiments[experiment.name].to_dict()
        for path, there, here in _differences(stored, experiment.to_dict()):
            raise StudyError(
                f"{where}: {path} of {experiment.name} is {there} there and {here} here; choose another --out"
            )


def _list_briefly(names: Sequence[str], most: int = 10) -> str:
    more = f" and {len(names) - most:,} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more


def _differences(there: Any, here: Any, path: str = "") -> Iterator[tuple[str, Any, Any]]:
    if isinstance(there, dict) and isinstance(here, dict):
        for key in there:
            yield from _differences(there[key], here[key], f"{path}.{key}" if path else key)
    elif there != here:
        yield path, there, here
