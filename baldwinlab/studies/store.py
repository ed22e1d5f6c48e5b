"""A study on disk: a directory with the experiments as TOML and one record a run.

    DIR/study.toml                              format, kind, seed, conditions, their factors; written last of all
    DIR/parts/sense-poison.py                   the source of a foreign part, kept and never executed: see `trust`
    DIR/runs/evo+self-taught/B/experiment.toml  the condition, whole
    DIR/runs/evo+self-taught/B/0007.nc          one run: netCDF, which carries a checksum of itself
    DIR/sessions.jsonl                          when it was worked on, how fast, with what

A file appears whole or not at all: it is written under another name and then renamed. So any number of workers may write to
one study, and a study that was interrupted lacks the runs that were in flight and nothing else. The directory may lie in an
object store, or wherever fsspec reaches (`files.location`). Format 1, which had no kind and no factors, and format 2, without
seals, can be read.
"""

from __future__ import annotations

import hashlib
import json
import re
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import xarray as xr

from baldwinlab.experiment import NAME_PATTERN, Experiment
from baldwinlab.experiment.toml import from_toml, to_toml
from baldwinlab.factors import CONDITIONS, KINDS, SWEEP, Factors, Kind
from baldwinlab.files import PARTIAL, append_line, is_local, text_of, toml_of, write_atomically
from baldwinlab.outputs import is_study, owner
from baldwinlab.studies import older, trust
from baldwinlab.studies.records import (
    MOST_RUNS,
    StudyError,
    read_attributes,
    read_record,
    record_path,
    stored_runs,
    write_record,
)
from baldwinlab.variables import whole

if TYPE_CHECKING:
    from baldwinlab.parts.foreign import Source

FORMAT = 3
SESSION = ("seconds", "compile_seconds", "workers", "agent_steps")  # the numbers that a session has
_SEAL = "# SHA-256 of the lines above, as they were when the study was made: "


def _kind_and_factors(facts: Mapping[str, Any], directory: Path) -> tuple[Kind, dict[str, Factors]]:
    """What `study.toml` says of them. Raises KeyError or ValueError where it is not what `create` writes."""
    match facts.get("format"):
        case 1:
            return older.kind_and_factors(directory, facts["conditions"])
        case 2 | 3:
            kind, tables = facts["kind"], facts["factors"]
        case unknown:
            raise ValueError(f"it has format {unknown}, and this version reads formats 1 to {FORMAT}")
    if kind not in KINDS:
        raise ValueError(f"kind = {kind!r} must be one of {', '.join(KINDS)}")
    for name in tables:
        if unknown := set(tables[name]) - set(Factors._fields):
            raise ValueError(f"factors.{name}: there is no factor {min(unknown)!r}; there are {', '.join(Factors._fields)}")
    return kind, {name: Factors(**tables.get(name, {})) for name in facts["conditions"]}


def _sealed(text: str) -> str:
    """A text, which says in its last line if it has been changed since."""
    return f"{text}{_SEAL}{hashlib.sha256(text.encode()).hexdigest()}\n"


def _require_seal(text: str, written: int) -> None:
    """Raises ValueError for a text that is not what was written. Studies of formats 1 and 2 may lack seals."""
    above, seal, digest = text.rpartition(_SEAL)
    if hashlib.sha256(above.encode()).hexdigest() != digest.strip() and (seal or written > 2):
        raise ValueError("it has been changed since the study was made, so it is not what its runs were made with; undo that")


def _text_of(path: Path) -> str:
    """Raises ValueError for what is no file, which could not be read to its end, and for a link to another folder."""
    if is_local(path) and path.exists() and path.resolve().parent != path.parent.resolve():
        raise ValueError("it is a link to a file elsewhere")
    return text_of(path)


def _require_sense(seed: Any, names: Any) -> None:
    """Raises ValueError unless these are a study's seed and the names of its conditions, each of which is a folder's below it."""
    if type(seed) is not int or not 0 <= seed < MOST_RUNS:
        raise ValueError(f"seed = {seed!r} must be a whole number, at least 0 and less than {MOST_RUNS}")
    if not isinstance(names, list):
        raise ValueError(f"conditions = {names!r} must be a list of names")
    for name in names:
        if not isinstance(name, str) or not re.match(NAME_PATTERN, name):
            raise ValueError(f"conditions: {name!r} is no name of a condition")


class Study:
    """An existing study directory. Make one with `create`, open one with `Study(directory)`."""

    def __init__(self, directory: Path) -> None:
        """Raises StudyError if the directory holds no study that can be read."""
        self.directory = directory
        path = directory / "study.toml"
        try:
            text = _text_of(path)
            facts = toml_of(text)
            self.seed: int = facts["seed"]
            names: list[str] = facts["conditions"]
            _require_sense(self.seed, names)
            self.kind, self.factors = _kind_and_factors(facts, directory)
            self.format: int = facts["format"]
            _require_seal(text, self.format)
            self.parts = trust.read(facts)  # the foreign ones
            self.paper: str = facts.get("paper", "")  # that made it; "" where none did
        except FileNotFoundError:
            raise StudyError(f"{directory} holds no study: it has no study.toml") from None
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise StudyError(f"{path} cannot be read: {error}") from None
        self.experiments = {name: self._experiment(name) for name in names}

    def _experiment(self, condition: str) -> Experiment:
        path = self.directory / "runs" / condition / "experiment.toml"
        try:
            text = _text_of(path)
            _require_seal(text, self.format)
            experiment = from_toml(text, where=str(path), reading=True)
            if experiment.name != condition:
                raise ValueError(f"it is that of the condition {experiment.name}")
            return experiment
        except (OSError, ValueError, RecursionError) as error:
            raise StudyError(f"{path} cannot be read: {error}") from None

    def exists(self) -> bool:
        """Whether it is still there: it may have been removed or moved since it was opened."""
        return is_study(self.directory)

    def experiment(self, condition: str) -> Experiment:
        """Raises StudyError for a condition that the study has not."""
        if condition not in self.experiments:
            raise StudyError(f"{self.directory} has no condition {condition!r}; it has {_listed(list(self.experiments))}")
        return self.experiments[condition]

    def require_parts(self, *conditions: str) -> None:
        """Raises PartError where these conditions (or all, unless any is given) choose a part that is not here, or is another."""
        trust.require(self.directory, self.parts, map(self.experiment, conditions or self.experiments))

    def path(self, condition: str, run: int) -> Path:
        return record_path(self.directory, condition, run)

    def runs(self, condition: str) -> list[int]:
        """The runs that are stored, sound or not."""
        return sorted(stored_runs(self.directory / "runs" / condition))

    def require_runs(self) -> None:
        """Raises StudyError where no run is stored yet."""
        if not any(self.runs(condition) for condition in self.experiments):
            raise StudyError(f"{self.directory} holds no finished run yet; the command that made it carries on")

    def write(self, condition: str, run: int, record: xr.Dataset) -> None:
        write_record(self.directory, condition, run, record)

    def read(self, condition: str, run: int, *, genomes: bool = True) -> xr.Dataset:
        """One run, whole; without genomes where those that are not kept would fill memory with NaN. Raises as `record` does."""
        record = self.record(condition, run)
        return whole(record) if genomes else record.drop_dims("kept_generation").drop_vars(["module", "weight"])

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
        write_atomically(aside, path.read_bytes())  # not renamed, which an object cannot be
        path.unlink()
        return aside

    def sweep(self) -> None:
        """Remove what killed writers left. A writer at work needs its file for moments only, so anything older than a minute."""
        for leftover in self.directory.rglob(f".*{PARTIAL}") if is_local(self.directory) else ():
            if time.time() - leftover.stat().st_mtime > 60:
                leftover.unlink(missing_ok=True)

    def add_session(self, facts: dict[str, Any]) -> None:
        append_line(self.directory / "sessions.jsonl", json.dumps(facts))

    def sessions(self) -> Iterator[dict[str, Any]]:
        """The sessions in which the study was worked on. A line torn by a kill, or of another kind, is passed over."""
        path = self.directory / "sessions.jsonl"
        for line in path.read_text("utf-8").splitlines() if path.exists() else []:
            try:
                session = json.loads(line)
            except (json.JSONDecodeError, RecursionError):
                continue
            if isinstance(session, dict) and all(isinstance(session.get(name), int | float) for name in SESSION):
                yield session


def create(
    directory: Path,
    experiments: Sequence[Experiment],
    seed: int,
    kind: Kind = CONDITIONS,
    factors: Mapping[str, Factors] = MappingProxyType({}),
    paper: str = "",
) -> Study:
    """Make a study, or open the one that is there if it is the same.

    `factors` are those of the conditions by name; a condition without a learner is its own, but for the points of a sweep.
    `paper` is the name of the one that it is made by, if any.
    Raises StudyError if the directory holds another study or anything else: it is never mixed, never overwritten.
    """
    names = [experiment.name for experiment in experiments]
    if len(set(names)) < len(names):
        raise StudyError(f"two conditions have the same name: {_listed(names)}")
    for name in names:
        if any(part.endswith((".nc", ".toml", ".damaged")) for part in name.split("/")):
            raise StudyError(f"no condition can be called {name!r}: a study has files with such endings")
    if is_local(directory) and (folder := owner(directory)):
        raise StudyError(f"{directory} belongs to the study in {folder}; choose another --out")
    if is_study(directory):
        study = Study(directory)
        study.require_parts()
        _require_same(study, experiments, seed, paper)
        return study
    sources = trust.sources(experiments)
    try:
        if directory.exists() and not all(_may_lie_in_a_study(entry) for entry in directory.iterdir()):
            raise StudyError(f"{directory} is not empty and holds no study; choose another --out")
        for experiment in experiments:
            path = directory / "runs" / experiment.name / "experiment.toml"
            if path.exists() and from_toml(path.read_text("utf-8"), str(path), reading=True) != experiment:
                raise StudyError(f"{directory} holds the beginning of another study; choose another --out")
            write_atomically(path, _sealed(to_toml(experiment)).encode())
        trust.keep(directory, sources)
        text = _facts(names, seed, kind, factors, paper, sources)
        write_atomically(directory / "study.toml", _sealed(text).encode())
    except OSError as error:
        raise StudyError(f"{error.filename or directory} cannot be written: {error.strerror or error}") from None
    return Study(directory)


def _facts(
    names: Sequence[str], seed: int, kind: Kind, factors: Mapping[str, Factors], paper: str, sources: Sequence[Source]
) -> str:
    """The text of `study.toml`; of thousands of conditions, a TOML library would take a minute. A JSON text is one in TOML."""
    lines = [f"format = {FORMAT}", f'kind = "{kind}"', f"seed = {seed}", f"conditions = {json.dumps(names)}"]
    lines += [f"paper = {json.dumps(paper)}"] * bool(paper) + [*trust.lines(sources), "", "[factors]"]
    for name in names if kind != SWEEP else ():
        found = factors.get(name, Factors())
        found = found._replace(learner=found.learner or name)
        lines += [f'[factors."{name}"]', *(f"{key} = {json.dumps(value)}" for key, value in found._asdict().items() if value)]
    return "".join(f"{line}\n" for line in lines)


def _may_lie_in_a_study(entry: Path) -> bool:
    """Its own runs and parts, or a study in a folder of its own: results/paper may hold a multiverse before it is one itself."""
    return entry.name in ("runs", "parts") or (entry / "runs").is_dir()


def _require_same(study: Study, experiments: Sequence[Experiment], seed: int, paper: str) -> None:
    where = f"{study.directory} holds another study"
    if study.seed != seed:
        raise StudyError(f"{where}: its seed is {study.seed}, not {seed}; choose another --out")
    if paper and study.paper not in (paper, ""):
        raise StudyError(f"{where}: it is of the paper {study.paper}, not {paper}; choose another --out")
    names = [experiment.name for experiment in experiments]
    if list(study.experiments) != names:
        raise StudyError(
            f"{where}: its conditions are {_listed(list(study.experiments))}, not {_listed(names)}; choose another --out"
        )
    for experiment in experiments:
        stored = study.experiments[experiment.name].to_dict()
        for path, there, here in _differences(stored, experiment.to_dict()):
            raise StudyError(f"{where}: {path} of {experiment.name} is {there} there and {here} here; choose another --out")


def _listed(names: Sequence[str], most: int = 10) -> str:
    more = f" and {len(names) - most:,} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more


def _differences(there: Any, here: Any, path: str = "") -> Iterator[tuple[str, Any, Any]]:
    if isinstance(there, dict) and isinstance(here, dict):
        for key in there:
            yield from _differences(there[key], here[key], f"{path}.{key}" if path else key)
    elif there != here:
        yield path, there, here
