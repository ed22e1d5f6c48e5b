"""Text of `study.toml` with its checksum, and copies of data files and of sources of parts.

    DIR/study.toml                                [[parts]]: kind, name and SHA-256 of each part
    DIR/inputs/evo-A-generation-99-1a2b3c4d.nc    genomes of founders
    DIR/inputs/worth-5e6f7a8b.txt                 data file of a part
    DIR/parts/model-bit-strings.py                source of a part when the study was created

A study therefore needs no file outside of its directory. The name of a copy ends in the first
digits of the SHA-256 of the content, so two data files with one name do not collide. The
experiments of the study contain the path of a copy relative to the directory, so the directory can
be moved.

The stored sources are never executed. No part is needed to read the results of a study. For a
simulation, the user loads the same parts again with --part. The last line of `study.toml`, and of
each `experiment.toml`, is a checksum of the lines above.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Sequence
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Annotated, Any, Final

from pydantic import Field, ValidationError, field_validator

from baldwinlab.core.errors import PartError
from baldwinlab.core.file_writing import write_exclusively
from baldwinlab.core.files import (
    STUDY_FILE,
    STUDY_FILE_NAME,
    FileKind,
    is_local,
    parse_toml,
    quote_path,
    read_text,
    require_inside_study,
)
from baldwinlab.core.names import CONDITION_NAME, read_stem
from baldwinlab.core.numbers import SEED_LIMIT
from baldwinlab.experiment import BaseExperiment, validate
from baldwinlab.experiment.added_parts import custom_choices
from baldwinlab.experiment.conditions import FACTOR_NAMES, Factors, StudyKind
from baldwinlab.experiment.fields import Fields, format_validation_error
from baldwinlab.experiment.file import File, iterate_file_tables, remember_path, require_files
from baldwinlab.experiment.registry import EXECUTION_HINT
from baldwinlab.studies.record_files import StudyError

# `parts.loading` is imported late: it loads slowly, and most studies have no third-party part.
if TYPE_CHECKING:
    from baldwinlab.parts.loading import Source

STUDY_FORMAT: Final = 3
_CHECKSUM_PREFIX = "# SHA-256 of the lines above, as they were when the study was made: "

INPUT_FOLDER: Final = "inputs"
NAME_DIGITS: Final = 8


# A seed, or the number of a run.
_Index = Annotated[int, Field(strict=True, ge=0, lt=SEED_LIMIT)]


class PartRecord(Fields):
    """A third-party part of a study, as in `study.toml`."""

    kind: str
    name: str
    sha256: str


class StudyFile(Fields):
    """The content of `study.toml` without its format and its checksum."""

    kind: StudyKind
    seed: _Index
    conditions: tuple[Annotated[str, Field(pattern=CONDITION_NAME)], ...]
    paper: str = ""  # Name of the reproduced paper, "" if the study has none.
    changes: tuple[str, ...] = ()  # Assignments that changed the model of the paper.
    first_run: _Index = 0
    parts: tuple[PartRecord, ...] = ()
    factors: dict[str, Factors]  # By condition. The points of a sweep have none.

    @field_validator("conditions")
    @classmethod
    def _require_different_names(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        if not names or len(set(names)) < len(names):
            raise ValueError("must be a list of at least one name, with each name once")
        return names

    @field_validator("factors", mode="before")
    @classmethod
    def _require_known_factors(cls, factors: Any) -> Any:
        tables = factors if isinstance(factors, dict) else {}
        for name, table in tables.items():
            unknown = set(table) - {*FACTOR_NAMES} if isinstance(table, dict) else ()
            if unknown:
                allowed = ", ".join(FACTOR_NAMES)
                raise ValueError(f"{name} has no factor {min(unknown)!r}; there are {allowed}")
        return factors


def read_study_file(directory: Path) -> StudyFile:
    """Return the content of the `study.toml` of a study. Raises StudyError if it is invalid."""
    path = directory / STUDY_FILE_NAME
    try:
        text = read_text_of_study(path, STUDY_FILE)
        content = parse_toml(text)
        study_format = content.pop("format", None)
        if study_format != STUDY_FORMAT:
            raise ValueError(
                f"it has format {study_format!r}, and this version reads only format "
                f"{STUDY_FORMAT}; open it with the version that wrote it, or create the study "
                "again in another directory"
            )
        study_file = StudyFile.model_validate(content)
        require_checksum(text)
    except FileNotFoundError:
        raise StudyError(f"{directory} holds no study: it has no study.toml") from None
    except ValidationError as error:
        faults = format_validation_error(error, StudyFile)
        raise StudyError(f"{path} cannot be read: {faults}") from None
    except (OSError, ValueError) as error:
        raise StudyError(f"{path} cannot be read: {error}") from None
    return study_file


def add_checksum(text: str) -> str:
    """Append a line with the SHA-256 of the text."""
    return f"{text}{_CHECKSUM_PREFIX}{hashlib.sha256(text.encode()).hexdigest()}\n"


def require_checksum(text: str) -> None:
    """Raise ValueError if the last line of a text is not the checksum of the lines above."""
    text_above, _, digest = text.rpartition(_CHECKSUM_PREFIX)
    if hashlib.sha256(text_above.encode()).hexdigest() != digest.strip():
        raise ValueError(
            "it has been changed since the study was created, so it does not describe its runs; "
            "undo the change"
        )


def read_text_of_study(path: Path, kind: FileKind) -> str:
    """Read a text file of a study.

    Raises as `read_text` does, and ValueError for a link to another folder.
    """
    if is_local(path) and path.exists() and path.resolve().parent != path.parent.resolve():
        raise ValueError("it is a link to a file in another folder")
    return read_text(path, kind)


def describe_changes(changes: Sequence[str]) -> str:
    """Return a sentence about the changes of the model of a paper; "" without changes."""
    if not changes:
        return ""
    return f"Changed model: {', '.join(changes)}. No verdict here is about the model of the paper."


def format_study(content: StudyFile) -> str:
    """Return the text of `study.toml`."""
    # A TOML library takes a minute for thousands of conditions. JSON strings are valid TOML.
    values = content.model_dump(exclude={"parts", "factors"}, exclude_defaults=True)
    lines = [f"format = {STUDY_FORMAT}"]
    lines += [f"{key} = {json.dumps(value)}" for key, value in values.items()]
    for part in content.parts:
        lines += ["[[parts]]", *(f'{key} = "{value}"' for key, value in part)]
    lines += ["", "[factors]"]
    for name, condition_factors in content.factors.items():
        lines.append(f'[factors."{name}"]')
        for key, value in condition_factors._asdict().items():
            if value:
                lines.append(f"{key} = {json.dumps(value)}")
    return add_checksum("".join(f"{line}\n" for line in lines))


def name_copies(experiments: Sequence[BaseExperiment]) -> list[Any]:
    """Replace the path of each data file in experiments by the path of the copy in a study."""
    renamed = []
    for experiment in experiments:
        tree = experiment.to_dict()
        tables = [table for _, table in iterate_file_tables(tree)]
        for table in tables:
            table["path"] = _name_copy(table)
        # `lenient`: the settings are valid already. Most experiments have no data file.
        renamed.append(validate(tree, lenient=True) if tables else experiment)
    return renamed


def _name_copy(table: dict[str, Any]) -> str:
    """Return the path of the copy of a data file in a study: inputs/worth-5e6f7a8b.txt."""
    path = PurePath(table["path"])
    ending = f"-{table['sha256'][:NAME_DIGITS]}"
    return f"{INPUT_FOLDER}/{read_stem(path).removesuffix(ending)}{ending}{path.suffix}"


def write_copies(directory: Path, experiments: Iterable[BaseExperiment]) -> None:
    """Write the data files of experiments, with the paths of `name_copies`, into a study."""
    for experiment in experiments:
        for _, table in iterate_file_tables(experiment.to_dict()):
            path = directory / table["path"]
            content = File(path=table["path"], sha256=table["sha256"]).read()
            _write_copy(directory, path, content)
            remember_path(table["sha256"], path)


def _write_copy(directory: Path, path: Path, content: bytes) -> None:
    """Write a file into a study. Raises StudyError if the file has other content."""
    require_inside_study(path, directory)
    try:
        write_exclusively(path, content)
    except FileExistsError:
        raise StudyError(f"{path} exists with other content; choose another --out") from None


def collect_sources(experiments: Iterable[BaseExperiment]) -> tuple[Source, ...]:
    """Return the sources of third-party parts. Raises PartError if a part is not loaded."""
    custom_experiments = [
        experiment for experiment in experiments if any(custom_choices(experiment))
    ]
    if not custom_experiments:
        return ()
    from baldwinlab.parts.loading import sources_of

    return sources_of(custom_experiments)


def stored_source(directory: Path, kind: str, name: str) -> Path:
    """Return the path of the source of a part in a study."""
    return directory / "parts" / f"{kind.replace(' ', '-')}-{name}.py"


def save_sources(directory: Path, sources: Sequence[Source]) -> None:
    """Write the sources of parts into a study. Raises StudyError if a file differs."""
    for source in sources:
        path = stored_source(directory, source.kind, source.name)
        _write_copy(directory, path, source.text.encode())


def require_same_parts(
    directory: Path, stored: Sequence[PartRecord], experiments: Iterable[BaseExperiment]
) -> None:
    """Check that the parts and data files of experiments are available and unchanged."""
    experiments = list(experiments)
    parts = {choice for experiment in experiments for choice in custom_choices(experiment)}
    _require_parts(directory, stored, parts)
    for experiment in experiments:
        require_files(experiment, f" in {directory}")


def _require_parts(
    directory: Path, stored: Sequence[PartRecord], parts: set[tuple[str, str]]
) -> None:
    """Raise PartError if one of `parts` (kind, name) is not loaded or differs from `stored`."""
    if not parts:
        return
    from baldwinlab.parts.loading import source_of

    hashes = {(part.kind, part.name): part.sha256 for part in stored}
    for kind, name in sorted(parts):
        stored_hash = hashes.get((kind, name))
        part = f"the {kind} {name!r} of {directory}"
        copy = quote_path(stored_source(directory, kind, name))
        try:
            source = source_of(kind, name)
        except PartError:
            raise PartError(
                f"{part} is not loaded; load its file, {EXECUTION_HINT}, for example the copy in "
                f"the study: --part {copy}"
            ) from None
        if stored_hash and source.sha256 != stored_hash:
            raise PartError(
                f"{part} differs from the loaded one; choose another --out, or load the original "
                f"file, {EXECUTION_HINT}, for example the copy in the study: --part {copy}"
            )
